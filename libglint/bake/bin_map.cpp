#include "glint/bake/bin_map.h"

#include <tbb/parallel_for.h>

#include <algorithm>
#include <bit>
#include <cmath>
#include <memory>
#include <string>
#include <utility>

#include "glint/bake/simd.h"
#include "glint/bake/slopes.h"
#include "glint/model/error.h"
#include "glint/query/half.h"

namespace glint::bake {
namespace {

/// Bins are counted in at most this many ranges of neighbours, from which classes are made.
constexpr std::size_t kMaxRanges = 1 << 16;
/// Blocks of texels that are counted on their own. Their number must not depend on threads.
constexpr std::size_t kBlocks = 16;
/// Classes are joined to at most this many buckets for the first pass: as many streams as a processor writes at once.
constexpr std::size_t kMaxBuckets = 512;
/// Texels binned at once.
constexpr std::size_t kChunk = 512;

void checkOptions(const NormalMap& map, const BinMapOptions& o) {
  const auto usage = [](const char* option, const std::string& range) {
    throw Error(ErrorCode::usage, "option.range", {}, option, "out of range", "give " + range);
  };
  if (!(o.alpha >= kMinBinAlpha && o.alpha <= 1)) usage("--alpha", "a Beckmann roughness of 0.0005 to 1");
  if (o.alpha_max != 0 && !(o.alpha_max >= o.alpha && o.alpha_max <= std::min(1.0f, kMaxAlphaRange * o.alpha)))
    usage("--alpha", "a range that rises to at most 1 and 64 times its beginning");
  if (!(o.leaf_size >= 1 && o.leaf_size <= 1024)) usage("--leaf-size", "1 to 1024 texels");
  if (map.width < 1 || map.height < 1) throw Error(ErrorCode::invalid_input, "normals.size", {}, {}, "the map has no texels");
  if (texelCode(map.width, map.height).place_bits < 0) {
    throw Error(ErrorCode::unsupported, "bin_map.size", {}, {},
                std::to_string(map.width) + " x " + std::to_string(map.height) + " texels are too many for a bin map",
                "cut the map to at most 16384 x 16384 texels, or as many in another shape of powers of two");
  }
}

/// A texel on its way to its list.
struct Entry {
  std::uint32_t code;
  std::uint32_t bin;
};

/// Bin number and place in the bin of each of some normals. Returns false if one is outside the disk.
GLINT_MULTIVERSION bool binNormals(const Vec2* normals, std::size_t count, int bins, int place_bits, std::uint32_t* bin,
                                   std::uint32_t* place) {
  const float half = 0.5f * static_cast<float>(bins);
  const auto steps = static_cast<float>(1 << place_bits);
  const int last = bins - 1, last_step = (1 << place_bits) - 1;
  int bad = 0;
  for (std::size_t k = 0; k < count; ++k) {
    const float nx = normals[k].x, ny = normals[k].y;
    bad |= !(nx * nx + ny * ny < 1);
    const float x = (nx + 1) * half, y = (ny + 1) * half;
    const int column = std::min(static_cast<int>(x), last), row = std::min(static_cast<int>(y), last);
    const int px = std::min(static_cast<int>((x - static_cast<float>(column)) * steps), last_step);
    const int py = std::min(static_cast<int>((y - static_cast<float>(row)) * steps), last_step);
    bin[k] = static_cast<std::uint32_t>(row * bins + column);
    place[k] = static_cast<std::uint32_t>(px | py << place_bits);
  }
  return bad == 0;
}

[[noreturn]] void throwOutside(const NormalMap& map) {
  std::size_t count = 0, first = 0;
  for (std::size_t k = map.normals.size(); k-- > 0;)
    if (!(dot(map.normals[k], map.normals[k]) < 1)) first = k, ++count;
  throw Error(ErrorCode::invalid_input, "normals.disk", {}, "/normals",
              std::to_string(count) + " normals are not inside the unit disk (first at column " +
                  std::to_string(first % map.width) + ", row " + std::to_string(first / map.width) + ")",
              "repair them with glint-ingest --fix-invalid");
}

std::uint32_t cellOf(const TexelCode& code, const CellGrid& grid, std::uint32_t texel) {
  return (code.row(texel) >> grid.row_shift) * static_cast<std::uint32_t>(grid.columns) +
         (code.column(texel) >> grid.column_shift);
}

/// Builds one bin map; each function is a step.
class Builder {
 public:
  Builder(const NormalMap& map, const BinMapOptions& options, const ProgressFn& progress)
      : map_(map), progress_(progress), code_(texelCode(map.width, map.height)), count_(map.normals.size()) {
    out_.width = map.width;
    out_.height = map.height;
    out_.alpha_min = options.alpha;
    out_.alpha_max = options.alpha_max == 0 ? options.alpha : options.alpha_max;
    out_.alpha = binAlpha(out_.alpha_min, out_.alpha_max, code_.place_bits);
    out_.leaf_size = options.leaf_size;
    out_.bins_per_axis = binsPerAxis(out_.alpha);
    bin_count_ = static_cast<std::size_t>(out_.bins_per_axis) * out_.bins_per_axis;
    while (((bin_count_ - 1) >> range_shift_) >= kMaxRanges) ++range_shift_;
    range_count_ = ((bin_count_ - 1) >> range_shift_) + 1;
    // Four texels' classes fill three words, so blocks of a multiple of four never share one.
    block_ = (count_ / kBlocks / kChunk + 1) * kChunk;
  }

  BinMapData build() {
    countRanges();
    step(1);
    makeClasses();
    scatter();
    step(2);
    countBins();
    indexBins();
    step(3);
    listTexels();
    finishIndex();
    out_.slopes = mapSlopes(map_);
    step(4);
    return std::move(out_);
  }

 private:
  void step(std::size_t done) const {
    if (progress_) progress_(done, 4);
  }

  /// Calls visitor(first texel, count, bins, places) for chunks of one block.
  template <class Visitor>
  bool forEachChunk(std::size_t block, Visitor&& visitor) const {
    std::uint32_t bins[kChunk], places[kChunk];
    const std::size_t end = std::min(count_, (block + 1) * block_);
    for (std::size_t first = block * block_; first < end; first += kChunk) {
      const std::size_t count = std::min(kChunk, end - first);
      if (!binNormals(map_.normals.data() + first, count, out_.bins_per_axis, code_.place_bits, bins, places)) return false;
      visitor(first, count, bins, places);
    }
    return true;
  }

  void countRanges() {
    range_counts_.resize(kBlocks);
    bool inside[kBlocks];
    tbb::parallel_for(std::size_t{0}, kBlocks, [&](std::size_t block) {
      std::vector<std::uint32_t>& counts = range_counts_[block];
      counts.assign(range_count_, 0);
      inside[block] = forEachChunk(block, [&](std::size_t, std::size_t count, const std::uint32_t* bins, const std::uint32_t*) {
        for (std::size_t k = 0; k < count; ++k) ++counts[bins[k] >> range_shift_];
      });
    });
    if (!std::all_of(inside, inside + kBlocks, [](bool b) { return b; })) throwOutside(map_);
  }

  /// Joins ranges to classes of about equal numbers of texels; where there are few ranges in use, each is a class.
  void makeClasses() {
    std::vector<std::uint64_t> totals(range_count_);
    for (const auto& counts : range_counts_)
      for (std::size_t r = 0; r < range_count_; ++r) totals[r] += counts[r];
    const auto used = static_cast<std::size_t>(std::count_if(totals.begin(), totals.end(), [](auto n) { return n > 0; }));
    const std::uint64_t wanted = used <= BinMap::kMaxClasses ? 1 : count_ / (BinMap::kMaxClasses - 1) + 1;
    range_classes_.resize(range_count_);
    out_.class_bins.push_back(0);
    std::uint64_t texels = 0;
    for (std::size_t r = 0; r < range_count_; ++r) {
      if (texels >= wanted && totals[r] > 0) {
        out_.class_bins.push_back(static_cast<std::uint32_t>(r << range_shift_));
        texels = 0;
      }
      range_classes_[r] = static_cast<std::uint16_t>(out_.class_bins.size() - 1);
      texels += totals[r];
    }
    class_count_ = out_.class_bins.size();
    out_.class_bins.push_back(static_cast<std::uint32_t>(bin_count_));
    while (((class_count_ - 1) >> bucket_shift_) >= kMaxBuckets) ++bucket_shift_;
    bucket_count_ = ((class_count_ - 1) >> bucket_shift_) + 1;
  }

  std::uint32_t firstBinOf(std::size_t bucket) const {
    return out_.class_bins[std::min(bucket << bucket_shift_, class_count_)];
  }

  /// Moves every texel to its bucket, in the order of the map, and notes the class.
  void scatter() {
    std::vector<std::vector<std::uint64_t>> cursors(kBlocks, std::vector<std::uint64_t>(bucket_count_));
    for (std::size_t block = 0; block < kBlocks; ++block)
      for (std::size_t r = 0; r < range_count_; ++r)
        cursors[block][range_classes_[r] >> bucket_shift_] += range_counts_[block][r];
    bucket_starts_.resize(bucket_count_ + 1);
    std::uint64_t next = 0;
    for (std::size_t bucket = 0; bucket < bucket_count_; ++bucket) {
      bucket_starts_[bucket] = next;
      for (auto& cursor : cursors) next += std::exchange(cursor[bucket], next);
    }
    bucket_starts_[bucket_count_] = next;
    entries_ = std::make_unique_for_overwrite<Entry[]>(count_);
    out_.texel_classes.assign((count_ * BinMap::kClassBits + 15) / 16, 0);
    tbb::parallel_for(std::size_t{0}, kBlocks, [&](std::size_t block) {
      std::uint64_t* cursor = cursors[block].data();
      forEachChunk(block, [&](std::size_t first, std::size_t count, const std::uint32_t* bins, const std::uint32_t* places) {
        std::uint16_t classes[kChunk];
        auto row = static_cast<std::uint32_t>(first / static_cast<std::size_t>(map_.width));
        auto column = static_cast<std::uint32_t>(first % static_cast<std::size_t>(map_.width));
        const int place_shift = code_.column_bits + code_.row_bits;
        for (std::size_t k = 0; k < count; ++k) {
          classes[k] = range_classes_[bins[k] >> range_shift_];
          entries_[cursor[classes[k] >> bucket_shift_]++] = {code_.pack(column, row, 0, 0) | places[k] << place_shift, bins[k]};
          if (++column == static_cast<std::uint32_t>(map_.width)) column = 0, ++row;
        }
        packClasses(first, count, classes);
      });
    });
    range_counts_.clear();
  }

  void packClasses(std::size_t first, std::size_t count, const std::uint16_t* classes) {
    std::uint16_t* words = out_.texel_classes.data() + first * BinMap::kClassBits / 16;
    for (std::size_t k = 0; k < count; k += 4, words += 3) {
      std::uint64_t packed = 0;
      const std::size_t n = std::min<std::size_t>(4, count - k);
      for (std::size_t i = 0; i < n; ++i) packed |= std::uint64_t{classes[k + i]} << (BinMap::kClassBits * i);
      for (std::size_t w = 0; w < (n * BinMap::kClassBits + 15) / 16; ++w)
        words[w] = static_cast<std::uint16_t>(packed >> (16 * w));
    }
  }

  void countBins() {
    bin_counts_.assign(bin_count_, 0);
    tbb::parallel_for(std::size_t{0}, bucket_count_, [&](std::size_t bucket) {
      for (std::uint64_t k = bucket_starts_[bucket]; k < bucket_starts_[bucket + 1]; ++k) ++bin_counts_[entries_[k].bin];
    });
  }

  int cellBits(std::uint64_t texels) const {
    if (texels <= static_cast<std::uint64_t>(kGridLeaves) * out_.leaf_size) return 0;
    return std::min(static_cast<int>(std::bit_width(texels / out_.leaf_size)) - 1, code_.column_bits + code_.row_bits);
  }

  /// Numbers occupied bins and grids, and gives each its place.
  void indexBins() {
    out_.masks.assign((bin_count_ + 63) / 64, 0);
    out_.mask_ranks.resize(out_.masks.size());
    starts_.clear();
    bucket_ordinals_.assign(bucket_count_ + 1, 0);
    std::uint64_t start = 0, cells = 0;
    std::size_t next_bucket = 0;
    for (std::size_t bin = 0; bin < bin_count_; ++bin) {
      if (next_bucket < bucket_count_ && firstBinOf(next_bucket) == bin)
        bucket_ordinals_[next_bucket++] = static_cast<std::uint32_t>(starts_.size());
      if (bin % 64 == 0) out_.mask_ranks[bin / 64] = static_cast<std::uint32_t>(starts_.size());
      const std::uint32_t n = bin_counts_[bin];
      if (n == 0) continue;
      const std::size_t ordinal = starts_.size();
      if (ordinal % 64 == 0) {
        out_.grid_masks.push_back(0);
        out_.grid_ranks.push_back(static_cast<std::uint32_t>(out_.grid_cells.size()));
      }
      out_.masks[bin / 64] |= std::uint64_t{1} << (bin % 64);
      starts_.push_back(start);
      start += n;
      const int bits = cellBits(n);
      if (bits == 0) continue;
      out_.grid_masks.back() |= std::uint64_t{1} << (ordinal % 64);
      out_.grid_cells.push_back(static_cast<std::uint32_t>(cells));
      cells += (std::uint64_t{1} << bits) + 1;
    }
    starts_.push_back(start);
    bucket_ordinals_[bucket_count_] = static_cast<std::uint32_t>(starts_.size() - 1);
    out_.grid_moments.resize(5 * out_.grid_cells.size());
    out_.grid_cells.push_back(static_cast<std::uint32_t>(cells));
    cells_.resize(cells);
  }

  /// Sorts every bucket by bin, and large bins by cell.
  void listTexels() {
    out_.texels.resize(count_);
    tbb::parallel_for(std::size_t{0}, bucket_count_, [&](std::size_t bucket) {
      const std::uint32_t first_bin = firstBinOf(bucket), last_bin = firstBinOf(bucket + 1);
      std::vector<std::uint64_t> cursors(last_bin - first_bin);
      std::size_t ordinal = bucket_ordinals_[bucket];
      for (std::uint32_t bin = first_bin; bin < last_bin; ++bin)
        if (bin_counts_[bin] > 0) cursors[bin - first_bin] = starts_[ordinal++];
      for (std::uint64_t k = bucket_starts_[bucket]; k < bucket_starts_[bucket + 1]; ++k)
        out_.texels[cursors[entries_[k].bin - first_bin]++] = entries_[k].code;
      std::vector<std::uint32_t> scratch;
      for (ordinal = bucket_ordinals_[bucket]; ordinal < bucket_ordinals_[bucket + 1]; ++ordinal) {
        const std::uint64_t mask = out_.grid_masks[ordinal / 64], bit = std::uint64_t{1} << (ordinal % 64);
        if (mask & bit) sortByCell(ordinal, out_.grid_ranks[ordinal / 64] + std::popcount(mask & (bit - 1)), scratch);
      }
    });
  }

  void sortByCell(std::size_t ordinal, std::size_t grid_number, std::vector<std::uint32_t>& scratch) {
    std::uint32_t* texels = out_.texels.data() + starts_[ordinal];
    const std::size_t n = starts_[ordinal + 1] - starts_[ordinal];
    std::uint64_t* cells = cells_.data() + out_.grid_cells[grid_number];
    const std::size_t cell_count = out_.grid_cells[grid_number + 1] - out_.grid_cells[grid_number] - 1;
    const CellGrid grid = cellGrid(code_, static_cast<int>(std::bit_width(cell_count)) - 1);
    std::fill_n(cells, cell_count + 1, 0);
    for (std::size_t k = 0; k < n; ++k) ++cells[cellOf(code_, grid, texels[k])];
    std::uint64_t next = 0;
    for (std::size_t c = 0; c <= cell_count; ++c) next += std::exchange(cells[c], next);
    scratch.assign(texels, texels + n);
    for (const std::uint32_t texel : scratch) texels[cells[cellOf(code_, grid, texel)]++] = texel;
    // Each cursor ended where the next cell begins.
    for (std::size_t c = cell_count; c > 0; --c) cells[c] = starts_[ordinal] + cells[c - 1];
    cells[0] = starts_[ordinal];
    storeMoments(texels, n, out_.grid_moments.data() + 5 * grid_number);
  }

  void storeMoments(const std::uint32_t* texels, std::size_t n, std::uint16_t* moments) const {
    std::uint64_t x = 0, y = 0, xx = 0, xy = 0, yy = 0;
    for (std::size_t k = 0; k < n; ++k) {
      const std::uint64_t px = code_.placeX(texels[k]), py = code_.placeY(texels[k]);
      x += px, y += py, xx += px * px, xy += px * py, yy += py * py;
    }
    const double count = static_cast<double>(n), step = 1.0 / (1 << code_.place_bits);
    const double mx = static_cast<double>(x) / count, my = static_cast<double>(y) / count;
    const double values[5] = {(mx + 0.5) * step, (my + 0.5) * step, (static_cast<double>(xx) / count - mx * mx) * step * step,
                              (static_cast<double>(xy) / count - mx * my) * step * step,
                              (static_cast<double>(yy) / count - my * my) * step * step};
    for (int k = 0; k < 5; ++k) moments[k] = floatToHalf(static_cast<float>(values[k]));
  }

  void finishIndex() {
    out_.bin_starts = compactCounts(starts_);
    out_.cell_starts = compactCounts(cells_);
  }

  const NormalMap& map_;
  const ProgressFn& progress_;
  TexelCode code_;
  std::size_t count_, bin_count_ = 0, range_count_ = 0, class_count_ = 0, bucket_count_ = 0, block_ = 0;
  int range_shift_ = 0, bucket_shift_ = 0;
  std::vector<std::vector<std::uint32_t>> range_counts_;  // [block][range]
  std::vector<std::uint16_t> range_classes_;
  std::vector<std::uint64_t> bucket_starts_;
  std::vector<std::uint32_t> bucket_ordinals_;  // occupied bins before each bucket
  std::unique_ptr<Entry[]> entries_;
  std::vector<std::uint32_t> bin_counts_;
  std::vector<std::uint64_t> starts_, cells_;
  BinMapData out_;
};

}  // namespace

int binsPerAxis(float alpha) {
  const double reach = 3 * double{alpha} / std::sqrt(2.0);
  return std::min(static_cast<int>(5 * std::sqrt(1 + reach * reach) / reach), kMaxBinsPerAxis);
}

float binAlpha(float alpha_min, float alpha_max, int place_bits) {
  constexpr int kPlaceBits = 4;
  const float finest = alpha_min * std::exp2(static_cast<float>(std::max(place_bits - kPlaceBits, 0)));
  return alpha_min == alpha_max ? alpha_min : std::min(std::sqrt(alpha_min * alpha_max), finest);
}

CompactCountsData compactCounts(const std::vector<std::uint64_t>& values) {
  CompactCountsData data;
  const auto fits = [&](int shift) {
    const std::size_t step = std::size_t{1} << shift;
    for (std::size_t k = 0; k < values.size(); k += step)
      if (values[std::min(k + step, values.size()) - 1] - values[k] > UINT16_MAX) return false;
    return true;
  };
  data.shift = CompactCounts::kMaxShift;
  while (data.shift > 0 && !fits(data.shift)) --data.shift;
  const std::size_t step = std::size_t{1} << data.shift;
  for (std::size_t k = 0; k < values.size(); k += step) data.bases.push_back(values[k]);
  data.offsets.resize(values.size());
  for (std::size_t k = 0; k < values.size(); ++k)
    data.offsets[k] = static_cast<std::uint16_t>(values[k] - data.bases[k >> data.shift]);
  return data;
}

BinMap BinMapData::view() const {
  BinMap v;
  v.width = width;
  v.height = height;
  v.alpha = alpha;
  v.alpha_min = alpha_min;
  v.alpha_max = alpha_max;
  v.slopes = slopes;
  v.bins_per_axis = bins_per_axis;
  v.leaf_size = leaf_size;
  v.masks = masks;
  v.mask_ranks = mask_ranks;
  v.bin_starts = bin_starts.view();
  v.grid_masks = grid_masks;
  v.grid_ranks = grid_ranks;
  v.grid_cells = grid_cells;
  v.grid_moments = grid_moments;
  v.cell_starts = cell_starts.view();
  v.texels = texels;
  v.class_bins = class_bins;
  v.texel_classes = texel_classes;
  return v;
}

std::size_t BinMapData::sizeBytes() const {
  const auto bytes = [](const auto&... arrays) { return (... + (arrays.size() * sizeof(arrays[0]))); };
  return bytes(masks, grid_masks, mask_ranks, grid_ranks, grid_cells, grid_moments, bin_starts.bases, bin_starts.offsets,
               cell_starts.bases, cell_starts.offsets, texels, class_bins, texel_classes);
}

BinMapData buildBinMap(const NormalMap& map, const BinMapOptions& options, const ProgressFn& progress) {
  checkOptions(map, options);
  return Builder(map, options, progress).build();
}

}  // namespace glint::bake
