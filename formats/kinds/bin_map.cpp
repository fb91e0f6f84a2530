#include "glint/model/bin_map.h"

#include <bit>
#include <cmath>

#include "glint/formats/kinds/codec.h"
#include "glint/formats/kinds/pyramid_shape.h"

namespace glint::formats {
namespace {

std::size_t texelCount(const BinMap& map) { return static_cast<std::size_t>(map.width) * static_cast<std::size_t>(map.height); }

/// Whether ranks are the running count of mask bits, the bits are of `bits` places, and `count` of them are set.
bool masksHold(std::span<const std::uint64_t> masks, std::span<const std::uint32_t> ranks, std::uint64_t bits,
               std::uint64_t count) {
  if (masks.size() != (bits + 63) / 64) return false;
  std::uint64_t running = 0;
  for (std::size_t w = 0; w < masks.size(); ++w) {
    if (ranks[w] != running) return false;
    running += static_cast<std::uint64_t>(std::popcount(masks[w]));
  }
  const bool tail = bits % 64 != 0 && (masks.back() >> (bits % 64)) != 0;
  return !tail && running == count;
}

bool startsHold(const BinMap& map) {
  if (map.bin_starts.size() < 2 || map.bin_starts[0] != 0) return false;
  for (std::size_t k = 1; k < map.bin_starts.size(); ++k)
    if (map.bin_starts[k] <= map.bin_starts[k - 1]) return false;
  return map.bin_starts[map.bin_starts.size() - 1] == texelCount(map);
}

/// Calls visitor(ordinal, grid) for every occupied bin with a grid.
template <class Visitor>
void forEachGrid(const BinMap& map, Visitor&& visitor) {
  std::size_t grid = 0;
  for (std::size_t w = 0; w < map.grid_masks.size(); ++w)
    for (std::uint64_t bits = map.grid_masks[w]; bits != 0; bits &= bits - 1)
      visitor(64 * w + static_cast<std::size_t>(std::countr_zero(bits)), grid++);
}

/// Checks the grids of bins. Masks and bin starts must hold.
void checkGrids(const BinMap& map, Findings& findings) {
  const TexelCode code = texelCode(map.width, map.height);
  const std::uint64_t most = std::uint64_t{1} << (code.column_bits + code.row_bits);
  const auto holds = [&](std::size_t ordinal, std::size_t grid) {
    const std::uint64_t first = map.grid_cells[grid], end = map.grid_cells[grid + 1];
    if (end <= first + 1 || end > map.cell_starts.size()) return false;
    if (const std::uint64_t cells = end - first - 1; cells > most || !std::has_single_bit(cells)) return false;
    for (std::uint64_t c = first + 1; c < end; ++c)
      if (map.cell_starts[c] < map.cell_starts[c - 1]) return false;
    return map.cell_starts[first] == map.bin_starts[ordinal] && map.cell_starts[end - 1] == map.bin_starts[ordinal + 1];
  };
  bool whole = map.grid_cells[0] == 0 && map.grid_cells.back() == map.cell_starts.size();
  forEachGrid(map, [&](std::size_t ordinal, std::size_t grid) { whole = whole && holds(ordinal, grid); });
  if (!whole) findings.add("bin_map.grids", "/grid_cells", "does not divide the lists into powers of two of cells");
}

std::uint32_t classOf(const BinMap& map, std::size_t texel) {
  const std::size_t bit = texel * BinMap::kClassBits;
  std::uint32_t value = static_cast<std::uint32_t>(map.texel_classes[bit / 16]) >> (bit % 16);
  if (bit % 16 > 16 - BinMap::kClassBits)
    value |= static_cast<std::uint32_t>(map.texel_classes[bit / 16 + 1]) << (16 - bit % 16);
  return value & (BinMap::kMaxClasses - 1);
}

void checkClasses(const BinMap& map, Findings& findings) {
  const auto& bins = map.class_bins;
  bool divide = bins.size() >= 2 && bins.size() <= BinMap::kMaxClasses + 1 && bins[0] == 0 && bins.back() == map.binCount();
  for (std::size_t c = 1; divide && c < bins.size(); ++c) divide = bins[c] > bins[c - 1];
  if (!divide) {
    findings.add("bin_map.classes", "/class_bins", "does not rise from 0 to the number of bins");
    return;
  }
  for (std::size_t k = 0; k < texelCount(map); ++k) {
    if (classOf(map, k) < map.classCount()) continue;
    findings.add("bin_map.classes", "/texel_classes", "texel " + std::to_string(k) + " has a class that does not exist");
    return;
  }
}

/// Whether every texel of a list is of the map, new, in its class, and in its cell.
class ListCheck {
 public:
  explicit ListCheck(const BinMap& map) : map_(map), code_(texelCode(map.width, map.height)), seen_(texelCount(map)) {}

  bool holds(std::uint32_t bin, std::uint64_t begin, std::uint64_t end, const CellGrid* grid, std::uint32_t cell) {
    for (std::uint64_t k = begin; k < end; ++k) {
      const std::uint32_t column = code_.column(map_.texels[k]), row = code_.row(map_.texels[k]);
      if (column >= static_cast<std::uint32_t>(map_.width) || row >= static_cast<std::uint32_t>(map_.height)) return false;
      const std::size_t texel = std::size_t{row} * static_cast<std::size_t>(map_.width) + column;
      const std::uint32_t c = classOf(map_, texel);
      if (seen_[texel] || bin < map_.class_bins[c] || bin >= map_.class_bins[c + 1]) return false;
      seen_[texel] = true;
      if (grid != nullptr &&
          cell != (row >> grid->row_shift) * static_cast<std::uint32_t>(grid->columns) + (column >> grid->column_shift)) {
        return false;
      }
    }
    return true;
  }

 private:
  const BinMap& map_;
  TexelCode code_;
  std::vector<bool> seen_;
};

bool listsHold(const BinMap& map) {
  ListCheck check(map);
  std::size_t ordinal = 0, grid = 0;
  for (std::size_t w = 0; w < map.masks.size(); ++w) {
    for (std::uint64_t bits = map.masks[w]; bits != 0; bits &= bits - 1, ++ordinal) {
      const auto bin = static_cast<std::uint32_t>(64 * w + static_cast<std::size_t>(std::countr_zero(bits)));
      if ((map.grid_masks[ordinal / 64] >> (ordinal % 64) & 1) == 0) {
        if (!check.holds(bin, map.bin_starts[ordinal], map.bin_starts[ordinal + 1], nullptr, 0)) return false;
        continue;
      }
      const std::uint32_t first = map.grid_cells[grid], cells = map.grid_cells[grid + 1] - first - 1;
      const CellGrid shape = cellGrid(texelCode(map.width, map.height), static_cast<int>(std::bit_width(cells)) - 1);
      for (std::uint32_t c = 0; c < cells; ++c)
        if (!check.holds(bin, map.cell_starts[first + c], map.cell_starts[first + c + 1], &shape, c)) return false;
      ++grid;
    }
  }
  return true;
}

/// Value of a finite half-precision number.
double halfValue(std::uint16_t half) {
  const int exponent = half >> 10 & 31, mantissa = half & 1023;
  const double size = exponent == 0 ? std::ldexp(mantissa, -24) : std::ldexp(1024 + mantissa, exponent - 25);
  return half & 0x8000 ? -size : size;
}

/// Normals in a bin have means in [0, 1] and variances of at most 1/4. Rounding to half precision moves each by 2^-11.
bool momentsHold(std::span<const std::uint16_t> moments) {
  double v[5];
  for (int k = 0; k < 5; ++k) v[k] = halfValue(moments[static_cast<std::size_t>(k)]);
  const auto between = [](double x, double low, double high) { return x >= low && x <= high; };
  return between(v[0], 0, 1) && between(v[1], 0, 1) && between(v[2], 0, 0.25) && between(v[4], 0, 0.25) &&
         v[3] * v[3] <= 1.01 * v[2] * v[4] + 1e-6;
}

}  // namespace

PackedAsset pack(const BinMap& map) {
  PackedAsset packed{"bin-map", {}, {}};
  packed.integer("width", map.width);
  packed.integer("height", map.height);
  packed.real("alpha", map.alpha);
  packed.real("alpha_min", map.alpha_min);
  packed.real("alpha_max", map.alpha_max);
  packSlopes(map.slopes, packed);
  packed.integer("bins_per_axis", map.bins_per_axis);
  packed.integer("leaf_size", map.leaf_size);
  packed.integer("bin_starts_shift", map.bin_starts.shift);
  packed.integer("cell_starts_shift", map.cell_starts.shift);
  const auto list = [&](const char* path, ElementType type, const auto& values, std::uint64_t count) {
    packed.array(path, type, {count}, values.data(), values.size());
  };
  const auto counts = [&](const std::string& path, const CompactCounts& values) {
    const std::uint64_t step = std::uint64_t{1} << values.shift;
    list((path + "/offsets").c_str(), ElementType::u16, values.offsets, values.size());
    list((path + "/bases").c_str(), ElementType::u64, values.bases, (values.size() + step - 1) / step);
  };
  const std::uint64_t words = (map.binCount() + 63) / 64, grids = map.grid_cells.empty() ? 0 : map.grid_cells.size() - 1;
  list("masks", ElementType::u64, map.masks, words);
  list("mask_ranks", ElementType::u32, map.mask_ranks, words);
  counts("bin_starts", map.bin_starts);
  list("grid_masks", ElementType::u64, map.grid_masks, map.grid_masks.size());
  list("grid_ranks", ElementType::u32, map.grid_ranks, map.grid_masks.size());
  packed.array("grid_moments", ElementType::f16, {grids, 5}, map.grid_moments.data(), map.grid_moments.size());
  list("grid_cells", ElementType::u32, map.grid_cells, grids + 1);
  counts("cell_starts", map.cell_starts);
  list("texels", ElementType::u32, map.texels, texelCount(map));
  list("class_bins", ElementType::u32, map.class_bins, map.class_bins.size());
  list("texel_classes", ElementType::u16, map.texel_classes, (texelCount(map) * BinMap::kClassBits + 15) / 16);
  return packed;
}

void unpack(const Content& content, BinMap& map) {
  map.width = content.integer("width");
  map.height = content.integer("height");
  map.alpha = content.real("alpha");
  map.alpha_min = content.real("alpha_min");
  map.alpha_max = content.real("alpha_max");
  map.slopes = unpackSlopes(content);
  map.bins_per_axis = content.integer("bins_per_axis");
  map.leaf_size = content.integer("leaf_size");
  const auto counts = [&](const std::string& path, int shift) {
    return CompactCounts{content.array<std::uint64_t>(path + "/bases"), content.array<std::uint16_t>(path + "/offsets"), shift};
  };
  map.masks = content.array<std::uint64_t>("masks");
  map.mask_ranks = content.array<std::uint32_t>("mask_ranks");
  map.bin_starts = counts("bin_starts", content.integer("bin_starts_shift"));
  map.grid_masks = content.array<std::uint64_t>("grid_masks");
  map.grid_ranks = content.array<std::uint32_t>("grid_ranks");
  map.grid_moments = content.array<std::uint16_t>("grid_moments");
  map.grid_cells = content.array<std::uint32_t>("grid_cells");
  map.cell_starts = counts("cell_starts", content.integer("cell_starts_shift"));
  map.texels = content.array<std::uint32_t>("texels");
  map.class_bins = content.array<std::uint32_t>("class_bins");
  map.texel_classes = content.array<std::uint16_t>("texel_classes");
}

void checkIndex(const BinMap& map, Findings& findings) {
  if (!(map.alpha_min <= map.alpha && map.alpha <= map.alpha_max))
    findings.add("bin_map.alpha", "/@alpha", "is not between alpha_min and alpha_max");
  checkSlopes(map.slopes, findings);
  if (texelCode(map.width, map.height).place_bits < 0) {
    findings.add("bin_map.size", "/", "has " + std::to_string(map.width) + " x " + std::to_string(map.height) + " texels");
    return;
  }
  if (!startsHold(map)) {
    findings.add("bin_map.bin_starts", "/bin_starts/offsets", "does not rise from 0 to the number of texels");
    return;
  }
  const bool occupied = masksHold(map.masks, map.mask_ranks, map.binCount(), map.occupiedBins());
  if (!occupied) findings.add("bin_map.masks", "/masks", "does not agree with mask_ranks and bin_starts");
  if (!masksHold(map.grid_masks, map.grid_ranks, map.occupiedBins(), map.grid_cells.size() - 1)) {
    findings.add("bin_map.masks", "/grid_masks", "does not agree with grid_ranks and grid_cells");
    return;
  }
  checkGrids(map, findings);
  checkClasses(map, findings);
}

void checkData(const BinMap& map, Findings& findings) {
  if (!listsHold(map)) findings.add("bin_map.texels", "/texels", "does not list every texel once, in its class and its cell");
  for (std::size_t g = 0; g + 1 < map.grid_cells.size(); ++g) {
    if (momentsHold(map.grid_moments.subspan(5 * g, 5))) continue;
    findings.add("bin_map.moments", "/grid_moments", "grid " + std::to_string(g) + " has moments of no distribution in a bin");
    return;
  }
}

}  // namespace glint::formats
