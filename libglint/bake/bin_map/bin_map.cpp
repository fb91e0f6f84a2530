#include "glint/bake/bin_map/bin_map.h"

#include <tbb/parallel_for.h>

#include <algorithm>
#include <bit>
#include <cmath>
#include <memory>
#include <string>
#include <utility>

#include "glint/bake/common/simd.h"
#include "glint/bake/common/slopes.h"
#include "glint/math/half.h"
#include "glint/model/error.h"
#include "glint/model/texel_name.h"

namespace glint::bake {
namespace {

/// Bins are counted in at most this many ranges of neighbouring keys, to divide the work.
constexpr std::size_t kMaxRanges = 1 << 16;
/// Parts of the map that are counted on their own. Their number must not depend on threads.
constexpr std::size_t kParts = 16;
/// Tiles are joined to about this many buckets for the first pass: as many streams as a processor writes at once.
constexpr std::size_t kBuckets = 512;
/// Tiles have about this many texels, or are the bins themselves; but tiles of more bins than 8 x 8, which large footprints
/// would have to search, only where they have few texels.
constexpr std::size_t kTexelsOfTile = 1024, kFewTexelsOfTile = 64;
constexpr int kWideTileBits = 3;
/// Blocks of several bins have at most this many texels, and none of their bins more than kMostOfSharedBin: merging texels (see
/// BinMapNdf) is for blocks.
constexpr std::uint64_t kMostOfBlock = 4096, kMostOfSharedBin = 512;
/// Places in bins are kept to at least this many bits along each axis, where the map is not too large for it; and to all that a
/// code can have on maps of few texels, where nothing averages their rounding.
constexpr int kSurePlaceBits = 5;
constexpr int kFewPositionBits = 8;
/// Bits along each axis that a place in a block has at most: half of a code.
constexpr int kMostBlockPlaceBits = 16;
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
  std::uint32_t code;  // texelCode
  std::uint32_t key;   // of its bin
};

/// A block that is being filled.
struct Block {
  std::uint32_t first_key, first_cell, texels;
  std::uint16_t column, row;  // of its first bin
  std::uint8_t side_bits, cell_bits;
};

/// Column and row of the bin, and place in it, of each of some normals. Returns false if one is outside the disk.
GLINT_MULTIVERSION bool binNormals(const Vec2* normals, std::size_t count, int bins, int place_bits, std::uint16_t* columns,
                                   std::uint16_t* rows, std::uint16_t* places) {
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
    columns[k] = static_cast<std::uint16_t>(column);
    rows[k] = static_cast<std::uint16_t>(row);
    places[k] = static_cast<std::uint16_t>(px | py << place_bits);
  }
  return bad == 0;
}

/// Bit k of x becomes bit 2 k.
std::uint32_t spreadBits(std::uint32_t x) {
  std::uint32_t spread = 0;
  for (int k = 0; k < 16; ++k) spread |= (x >> k & 1) << 2 * k;
  return spread;
}

[[noreturn]] void throwOutside(const NormalMap& map) {
  TexelTally outside(map.width, map.height);
  for (std::size_t k = 0; k < map.normals.size(); ++k)
    if (!(dot(map.normals[k], map.normals[k]) < 1)) outside.add(k);
  throw Error(ErrorCode::invalid_input, "normals.disk", {}, "/normals",
              std::to_string(outside.count()) + " normals are not inside the unit disk (first at " + outside.firstName() + ")",
              "make the map again with glint-ingest, which moves normals on the rim inside");
}

/// Every second bit of x, from bit 0 on.
std::uint32_t gatherBits(std::uint32_t x) {
  x &= 0x55555555;
  x = (x | x >> 1) & 0x33333333;
  x = (x | x >> 2) & 0x0f0f0f0f;
  x = (x | x >> 4) & 0x00ff00ff;
  return (x | x >> 8) & 0x0000ffff;
}

/// Sorts and packs the texels of a block.
class BlockPacker {
 public:
  /// @param map  code of entries
  /// @param first_cell  of the cells that are counted from 0
  BlockPacker(const TexelCode& map, const Block& block, std::uint32_t first_cell)
      : map_(map),
        code_(blockCode(map, block.side_bits, block.cell_bits)),
        grid_(cellGrid(map, block.cell_bits)),
        first_cell_(block.first_cell - first_cell),
        key_mask_((1u << 2 * block.side_bits) - 1),
        kept_bits_(code_.place_bits - block.side_bits) {}

  std::uint32_t cell(const Entry& entry) const {
    return first_cell_ + (map_.row(entry.code) >> grid_.row_shift) * static_cast<std::uint32_t>(grid_.columns) +
           (map_.column(entry.code) >> grid_.column_shift);
  }

  std::uint32_t pack(const Entry& entry) const {
    const std::uint32_t bin = entry.key & key_mask_;
    const int dropped = map_.place_bits - kept_bits_;
    return code_.pack(map_.column(entry.code) & ((1u << grid_.column_shift) - 1),
                      map_.row(entry.code) & ((1u << grid_.row_shift) - 1),
                      gatherBits(bin) << kept_bits_ | map_.placeX(entry.code) >> dropped,
                      gatherBits(bin >> 1) << kept_bits_ | map_.placeY(entry.code) >> dropped);
  }

 private:
  TexelCode map_, code_;
  CellGrid grid_;
  std::uint32_t first_cell_, key_mask_;
  int kept_bits_;
};

/// Bits along each axis that places in the bins of a map have at least: one less for each bit of position beyond few.
int surePlaceBits(const TexelCode& map) {
  const int beyond = std::max(map.column_bits + map.row_bits - kFewPositionBits, 0);
  return std::min(std::max(TexelCode::kMaxPlaceBits - beyond, kSurePlaceBits), map.place_bits);
}

/// Logarithm of the number of cells of a block: about `wanted`, but enough that codes keep places to surePlaceBits.
int cellBits(const TexelCode& map, int side_bits, std::uint64_t wanted) {
  const int most = map.column_bits + map.row_bits;
  int bits = std::min(wanted == 0 ? 0 : static_cast<int>(std::bit_width(wanted)) - 1, most);
  const int sure = side_bits + surePlaceBits(map);
  while (bits < most && blockCode(map, side_bits, bits).place_bits < sure) ++bits;
  return bits;
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
    out_.tile_bits = tileBits(out_.bins_per_axis, count_);
    tiles_ = (out_.bins_per_axis - 1) / (1 << out_.tile_bits) + 1;
    key_count_ = (static_cast<std::size_t>(tiles_) * tiles_) << 2 * out_.tile_bits;
    makeKeys();
    while (((key_count_ - 1) >> range_shift_) >= kMaxRanges) ++range_shift_;
    range_count_ = ((key_count_ - 1) >> range_shift_) + 1;
    // Four texels' classes fill three words, so parts of a multiple of four never share one.
    chunk_ = (count_ / kParts / kChunk + 1) * kChunk;
  }

  BinMapData build() {
    countRanges();
    step(1);
    makeBuckets();
    scatter();
    step(2);
    countBins();
    divideTiles();
    makeClasses();
    step(3);
    listTexels();
    classifyTexels();
    out_.cell_starts = compactCounts(cells_);
    out_.slopes = mapSlopes(map_);
    step(4);
    return std::move(out_);
  }

 private:
  void step(std::size_t done) const {
    if (progress_) progress_(done, 4);
  }

  /// A bin's key is the sum of those of its column and its row.
  void makeKeys() {
    const int bits = out_.tile_bits;
    for (int k = 0; k < out_.bins_per_axis; ++k) {
      const auto tile = static_cast<std::uint32_t>(k >> bits);
      const std::uint32_t within = spreadBits(static_cast<std::uint32_t>(k) & ((1u << bits) - 1));
      column_keys_.push_back((tile << 2 * bits) + within);
      row_keys_.push_back((tile * static_cast<std::uint32_t>(tiles_) << 2 * bits) + 2 * within);
    }
  }

  /// Calls visitor(first texel, count, keys of their bins, places) for chunks of one of kParts parts of the map.
  template <class Visitor>
  bool forEachChunk(std::size_t part, Visitor&& visitor) const {
    std::uint16_t columns[kChunk], rows[kChunk], places[kChunk];
    std::uint32_t keys[kChunk];
    const std::size_t end = std::min(count_, (part + 1) * chunk_);
    for (std::size_t first = part * chunk_; first < end; first += kChunk) {
      const std::size_t count = std::min(kChunk, end - first);
      const Vec2* normals = map_.normals.data() + first;
      if (!binNormals(normals, count, out_.bins_per_axis, code_.place_bits, columns, rows, places)) return false;
      for (std::size_t k = 0; k < count; ++k) keys[k] = column_keys_[columns[k]] + row_keys_[rows[k]];
      visitor(first, count, keys, places);
    }
    return true;
  }

  void countRanges() {
    range_counts_.resize(kParts);
    bool inside[kParts];
    tbb::parallel_for(std::size_t{0}, kParts, [&](std::size_t part) {
      std::vector<std::uint32_t>& counts = range_counts_[part];
      counts.assign(range_count_, 0);
      inside[part] = forEachChunk(part, [&](std::size_t, std::size_t count, const std::uint32_t* keys, const std::uint16_t*) {
        for (std::size_t k = 0; k < count; ++k) ++counts[keys[k] >> range_shift_];
      });
    });
    if (!std::all_of(inside, inside + kParts, [](bool b) { return b; })) throwOutside(map_);
    range_totals_.resize(range_count_);
    for (const auto& counts : range_counts_)
      for (std::size_t r = 0; r < range_count_; ++r) range_totals_[r] += counts[r];
  }

  /// Joins tiles to buckets of about equal numbers of texels.
  void makeBuckets() {
    const int key_bits = 2 * out_.tile_bits;
    const std::uint64_t wanted = count_ / kBuckets + 1;
    range_buckets_.resize(range_count_);
    bucket_tiles_.push_back(0);
    bucket_starts_.push_back(0);
    std::uint64_t texels = 0, all = 0;
    for (std::size_t r = 0; r < range_count_; ++r) {
      const std::size_t key = r << range_shift_, tile = key >> key_bits;
      if (texels >= wanted && key == tile << key_bits) {
        bucket_tiles_.push_back(tile);
        bucket_starts_.push_back(all);
        texels = 0;
      }
      range_buckets_[r] = static_cast<std::uint16_t>(bucket_tiles_.size() - 1);
      texels += range_totals_[r], all += range_totals_[r];
    }
    bucket_count_ = bucket_tiles_.size();
    bucket_tiles_.push_back(static_cast<std::size_t>(tiles_) * tiles_);
    bucket_starts_.push_back(all);
  }

  /// Moves every texel to its bucket, in the order of the map.
  void scatter() {
    std::vector<std::vector<std::uint64_t>> cursors(kParts, std::vector<std::uint64_t>(bucket_count_));
    for (std::size_t part = 0; part < kParts; ++part)
      for (std::size_t r = 0; r < range_count_; ++r) cursors[part][range_buckets_[r]] += range_counts_[part][r];
    for (std::size_t bucket = 0; bucket < bucket_count_; ++bucket) {
      std::uint64_t next = bucket_starts_[bucket];
      for (auto& cursor : cursors) next += std::exchange(cursor[bucket], next);
    }
    range_counts_.clear();
    entries_ = std::make_unique_for_overwrite<Entry[]>(count_);
    tbb::parallel_for(std::size_t{0}, kParts, [&](std::size_t part) {
      std::uint64_t* cursor = cursors[part].data();
      forEachChunk(part, [&](std::size_t first, std::size_t count, const std::uint32_t* keys, const std::uint16_t* places) {
        auto row = static_cast<std::uint32_t>(first / static_cast<std::size_t>(map_.width));
        auto column = static_cast<std::uint32_t>(first % static_cast<std::size_t>(map_.width));
        for (std::size_t k = 0; k < count; ++k) {
          entries_[cursor[range_buckets_[keys[k] >> range_shift_]]++] = {code_.pack(column, row, places[k], 0), keys[k]};
          if (++column == static_cast<std::uint32_t>(map_.width)) column = 0, ++row;
        }
      });
    });
  }

  void countBins() {
    bin_counts_.assign(key_count_, 0);
    tbb::parallel_for(std::size_t{0}, bucket_count_, [&](std::size_t bucket) {
      for (std::uint64_t k = bucket_starts_[bucket]; k < bucket_starts_[bucket + 1]; ++k) ++bin_counts_[entries_[k].key];
    });
  }

  /// Texels of some bins, and of the fullest of them.
  struct Filling {
    std::uint64_t all = 0, fullest = 0;
  };
  Filling filling(std::size_t first_key, int side_bits) const {
    Filling result;
    for (std::size_t key = first_key; key < first_key + (std::size_t{1} << 2 * side_bits); ++key) {
      result.all += bin_counts_[key];
      result.fullest = std::max<std::uint64_t>(result.fullest, bin_counts_[key]);
    }
    return result;
  }

  /// Divides every tile in blocks.
  void divideTiles() {
    const auto tiles = static_cast<std::uint32_t>(tiles_);
    out_.nodes.assign(2 * std::size_t{tiles} * tiles, 0);
    std::size_t bucket = 0;
    for (std::uint32_t tile = 0; tile < tiles * tiles; ++tile) {
      for (; bucket < bucket_count_ && bucket_tiles_[bucket] == tile; ++bucket)
        bucket_blocks_.push_back(static_cast<std::uint32_t>(blocks_.size()));
      const int bits = out_.tile_bits;
      divide(tile, std::size_t{tile} << 2 * bits,
             {0, 0, 0, static_cast<std::uint16_t>((tile % tiles) << bits), static_cast<std::uint16_t>((tile / tiles) << bits),
              static_cast<std::uint8_t>(bits), 0});
    }
    bucket_blocks_.push_back(static_cast<std::uint32_t>(blocks_.size()));
    out_.block_moments.resize(5 * blocks_.size());
    cells_.resize(cell_count_ + 1);
    cells_[cell_count_] = count_;
  }

  /// Makes a node a block, or the parent of four nodes, if it has texels.
  void divide(std::size_t node, std::size_t first_key, Block block) {
    const Filling texels = filling(first_key, block.side_bits);
    if (texels.all == 0) return;
    const bool is_coarse = block.side_bits + surePlaceBits(code_) > kMostBlockPlaceBits;
    if (block.side_bits > 0 && (texels.all > kMostOfBlock || texels.fullest > kMostOfSharedBin || is_coarse)) {
      const auto first_child = static_cast<std::uint32_t>(out_.nodes.size() / 2);
      out_.nodes[2 * node] = BinMap::kSplit;
      out_.nodes[2 * node + 1] = first_child;
      out_.nodes.resize(out_.nodes.size() + 8);
      --block.side_bits;
      for (std::uint32_t quadrant = 0; quadrant < 4; ++quadrant) {
        Block child = block;
        child.column = static_cast<std::uint16_t>(child.column + ((quadrant & 1) << block.side_bits));
        child.row = static_cast<std::uint16_t>(child.row + ((quadrant >> 1) << block.side_bits));
        divide(first_child + quadrant, first_key + (std::size_t{quadrant} << 2 * block.side_bits), child);
      }
      return;
    }
    block.first_key = static_cast<std::uint32_t>(first_key);
    block.first_cell = static_cast<std::uint32_t>(cell_count_);
    block.texels = static_cast<std::uint32_t>(texels.all);
    block.cell_bits = static_cast<std::uint8_t>(cellBits(code_, block.side_bits, texels.all / out_.leaf_size));
    const auto number = static_cast<std::uint32_t>(blocks_.size());
    out_.nodes[2 * node] = (block.cell_bits + 1u) | number << BinMap::kKindBits;
    out_.nodes[2 * node + 1] = block.first_cell;
    cell_count_ += std::size_t{1} << block.cell_bits;
    // Counts have been used: from now on a bin knows its block.
    std::fill_n(bin_counts_.begin() + static_cast<std::ptrdiff_t>(first_key), std::size_t{1} << 2 * block.side_bits, number);
    blocks_.push_back(block);
  }

  /// Makes a class of every block, or of several with about equal numbers of texels.
  void makeClasses() {
    const std::uint64_t wanted = blocks_.size() <= BinMap::kMaxClasses ? 1 : count_ / (BinMap::kMaxClasses - 1) + 1;
    block_classes_.reserve(blocks_.size());
    out_.class_keys.push_back(0);
    std::uint64_t texels = 0;
    for (const Block& block : blocks_) {
      if (texels >= wanted) {
        out_.class_keys.push_back(block.first_key);
        texels = 0;
      }
      block_classes_.push_back(static_cast<std::uint16_t>(out_.class_keys.size() - 1));
      texels += block.texels;
    }
    out_.class_keys.push_back(static_cast<std::uint32_t>(key_count_));
  }

  /// Notes the class of every texel.
  void classifyTexels() {
    out_.texel_classes.resize((count_ * BinMap::kClassBits + 15) / 16);
    tbb::parallel_for(std::size_t{0}, kParts, [&](std::size_t part) {
      forEachChunk(part, [&](std::size_t first, std::size_t count, const std::uint32_t* keys, const std::uint16_t*) {
        std::uint16_t classes[kChunk];
        for (std::size_t k = 0; k < count; ++k) classes[k] = block_classes_[bin_counts_[keys[k]]];
        packClasses(first, count, classes);
      });
    });
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

  /// Sorts every bucket by cell.
  void listTexels() {
    out_.texels.resize(count_);
    tbb::parallel_for(std::size_t{0}, bucket_count_, [&](std::size_t bucket) {
      const std::uint32_t first = bucket_blocks_[bucket], end = bucket_blocks_[bucket + 1];
      if (first == end) return;
      const std::uint32_t first_cell = blocks_[first].first_cell;
      std::vector<BlockPacker> packers;
      for (std::uint32_t b = first; b < end; ++b) packers.emplace_back(code_, blocks_[b], first_cell);
      const auto packerOf = [&](const Entry& entry) -> const BlockPacker& { return packers[bin_counts_[entry.key] - first]; };

      const Entry* entries = entries_.get() + bucket_starts_[bucket];
      const std::size_t count = bucket_starts_[bucket + 1] - bucket_starts_[bucket];
      std::vector<std::uint32_t> entry_cells(count);
      std::uint64_t* cells = cells_.data() + first_cell;
      const std::size_t cell_count = (end < blocks_.size() ? blocks_[end].first_cell : cell_count_) - first_cell;
      for (std::size_t k = 0; k < count; ++k) ++cells[entry_cells[k] = packerOf(entries[k]).cell(entries[k])];
      std::uint64_t next = bucket_starts_[bucket];
      for (std::size_t c = 0; c < cell_count; ++c) next += std::exchange(cells[c], next);
      for (std::size_t k = 0; k < count; ++k) out_.texels[cells[entry_cells[k]]++] = packerOf(entries[k]).pack(entries[k]);
      // Each cursor ended where the next cell begins.
      for (std::size_t c = cell_count; c-- > 1;) cells[c] = cells[c - 1];
      cells[0] = bucket_starts_[bucket];
      for (std::uint32_t b = first; b < end; ++b) {
        const std::uint64_t last = b + 1 < end ? cells_[blocks_[b + 1].first_cell] : bucket_starts_[bucket + 1];
        storeMoments(blocks_[b], cells_[blocks_[b].first_cell], last, out_.block_moments.data() + 5 * std::size_t{b});
      }
    });
  }

  /// Of the texels [begin, end) of a block.
  void storeMoments(const Block& block, std::uint64_t begin, std::uint64_t end, std::uint16_t* moments) const {
    const TexelCode code = blockCode(code_, block.side_bits, block.cell_bits);
    std::uint64_t x = 0, y = 0;
    double xx = 0, xy = 0, yy = 0;
    for (std::uint64_t k = begin; k < end; ++k) {
      const std::uint64_t px = code.placeX(out_.texels[k]), py = code.placeY(out_.texels[k]);
      x += px, y += py;
      xx += static_cast<double>(px * px), xy += static_cast<double>(px * py), yy += static_cast<double>(py * py);
    }
    const double count = static_cast<double>(end - begin), step = 1.0 / (1 << code.place_bits);
    const double mx = static_cast<double>(x) / count, my = static_cast<double>(y) / count;
    const double values[5] = {(mx + 0.5) * step, (my + 0.5) * step, (xx / count - mx * mx) * step * step,
                              (xy / count - mx * my) * step * step, (yy / count - my * my) * step * step};
    for (int k = 0; k < 5; ++k) moments[k] = floatToHalf(static_cast<float>(values[k]));
  }

  const NormalMap& map_;
  const ProgressFn& progress_;
  TexelCode code_;
  std::size_t count_, key_count_ = 0, range_count_ = 0, bucket_count_ = 0, chunk_ = 0, cell_count_ = 0;
  int tiles_ = 0, range_shift_ = 0;
  std::vector<std::uint32_t> column_keys_, row_keys_;
  std::vector<std::vector<std::uint32_t>> range_counts_;  // [part][range]
  std::vector<std::uint64_t> range_totals_;
  std::vector<std::uint16_t> range_buckets_, block_classes_;
  std::vector<std::size_t> bucket_tiles_;  // first of each bucket
  std::vector<std::uint64_t> bucket_starts_;
  std::vector<std::uint32_t> bucket_blocks_;  // first of each bucket
  std::unique_ptr<Entry[]> entries_;
  std::vector<std::uint32_t> bin_counts_;  // texels of each bin, by key; later the number of its block
  std::vector<Block> blocks_;
  std::vector<std::uint64_t> cells_;
  BinMapData out_;
};

}  // namespace

int binsPerAxis(float alpha) {
  const double reach = 3 * double{alpha} / std::sqrt(2.0);
  return std::min(static_cast<int>(5 * std::sqrt(1 + reach * reach) / reach), kMaxBinsPerAxis);
}

int tileBits(int bins_per_axis, std::size_t texels) {
  // The fewest bits with at most `most` tiles.
  const auto bitsFor = [&](std::size_t most) {
    int bits = 0;
    for (; bits < BinMap::kMaxTileBits; ++bits)
      if (const auto across = static_cast<std::size_t>((bins_per_axis - 1) >> bits) + 1; across * across <= most) break;
    return bits;
  };
  return std::min(bitsFor(texels / kTexelsOfTile), std::max(kWideTileBits, bitsFor(texels / kFewTexelsOfTile)));
}

float binAlpha(float alpha_min, float alpha_max, int place_bits) {
  constexpr int kPlaceBits = 4;
  const int spare = std::max(std::min(place_bits, kSurePlaceBits) - kPlaceBits, 0);
  const float finest = alpha_min * std::exp2(static_cast<float>(spare));
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
  v.tile_bits = tile_bits;
  v.nodes = nodes;
  v.block_moments = block_moments;
  v.cell_starts = cell_starts.view();
  v.texels = texels;
  v.class_keys = class_keys;
  v.texel_classes = texel_classes;
  return v;
}

std::size_t BinMapData::sizeBytes() const {
  const auto bytes = [](const auto&... arrays) { return (... + (arrays.size() * sizeof(arrays[0]))); };
  return bytes(nodes, block_moments, cell_starts.bases, cell_starts.offsets, texels, class_keys, texel_classes);
}

BinMapData buildBinMap(const NormalMap& map, const BinMapOptions& options, const ProgressFn& progress) {
  checkOptions(map, options);
  return Builder(map, options, progress).build();
}

}  // namespace glint::bake
