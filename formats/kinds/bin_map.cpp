#include "glint/model/bin_map.h"

#include <cmath>

#include "glint/formats/kinds/description.h"
#include "glint/formats/kinds/shared_fields.h"

namespace glint::formats {
namespace {

std::size_t texelCount(const BinMap& map) { return static_cast<std::size_t>(map.width) * static_cast<std::size_t>(map.height); }

bool startsHold(const BinMap& map) {
  if (map.cell_starts.size() < 2 || map.cell_starts[0] != 0) return false;
  for (std::size_t k = 1; k < map.cell_starts.size(); ++k)
    if (map.cell_starts[k] < map.cell_starts[k - 1]) return false;
  return map.cell_starts[map.cell_starts.size() - 1] == texelCount(map);
}

/// A node that is a block.
struct BlockOfNode {
  std::uint64_t first_key;
  int column, row;  ///< of its first bin
  int side_bits, cell_bits;
  std::uint64_t first_cell;
};

/// Walks the quadtrees of a bin map in order and checks that nodes, blocks and cells are numbered as they are met.
class TreeWalk {
 public:
  explicit TreeWalk(const BinMap& map) : map_(map), code_(texelCode(map.width, map.height)) {
    across_ = static_cast<std::uint64_t>(map.tilesPerAxis());
    next_node_ = across_ * across_;
  }

  /// Calls visitor(BlockOfNode) for each block. Returns false at the first node that is out of order.
  template <class Visitor>
  bool walk(Visitor&& visitor) {
    if (next_node_ > nodeCount()) return false;
    const int bits = map_.tile_bits;
    for (std::uint64_t tile = 0; tile < across_ * across_; ++tile) {
      const auto column = static_cast<int>(tile % across_), row = static_cast<int>(tile / across_);
      if (!visit(tile, {tile << 2 * bits, column << bits, row << bits, bits, 0, 0}, visitor)) return false;
    }
    return next_node_ == nodeCount() && next_block_ == map_.blockCount() && next_cell_ + 1 == map_.cell_starts.size();
  }

 private:
  std::uint64_t nodeCount() const { return map_.nodes.size() / 2; }

  template <class Visitor>
  bool visit(std::uint64_t node, BlockOfNode block, Visitor& visitor) {
    const std::uint32_t kind = map_.nodes[2 * node] & ((1u << BinMap::kKindBits) - 1);
    const std::uint32_t number = map_.nodes[2 * node] >> BinMap::kKindBits, first = map_.nodes[2 * node + 1];
    if (kind == BinMap::kEmpty) return number == 0 && first == 0;
    if (kind != BinMap::kSplit) {
      block.cell_bits = static_cast<int>(kind) - 1, block.first_cell = first;
      return visitBlock(block, number, visitor);
    }
    if (block.side_bits == 0 || number != 0 || first != next_node_ || first + 4ull > nodeCount()) return false;
    next_node_ += 4;
    --block.side_bits;
    for (std::uint64_t quadrant = 0; quadrant < 4; ++quadrant) {
      BlockOfNode child = block;
      child.first_key += quadrant << 2 * block.side_bits;
      child.column += static_cast<int>(quadrant & 1) << block.side_bits;
      child.row += static_cast<int>(quadrant >> 1) << block.side_bits;
      if (!visit(first + quadrant, child, visitor)) return false;
    }
    return true;
  }

  template <class Visitor>
  bool visitBlock(const BlockOfNode& block, std::uint32_t number, Visitor& visitor) {
    if (block.cell_bits > code_.column_bits + code_.row_bits) return false;
    if (number != next_block_++ || block.first_cell != next_cell_) return false;
    next_cell_ += std::uint64_t{1} << block.cell_bits;
    if (next_cell_ >= map_.cell_starts.size()) return false;
    if (map_.cell_starts[block.first_cell] == map_.cell_starts[next_cell_]) return false;
    if (blockCode(code_, block.side_bits, block.cell_bits).subbin_bits < block.side_bits) return false;
    return visitor(block);
  }

  const BinMap& map_;
  TexelCode code_;
  std::uint64_t across_, next_node_, next_block_ = 0, next_cell_ = 0;
};

std::uint32_t classOf(const BinMap& map, std::size_t texel) {
  const std::size_t bit = texel * BinMap::kClassBits;
  std::uint32_t value = static_cast<std::uint32_t>(map.texel_classes[bit / 16]) >> (bit % 16);
  if (bit % 16 > 16 - BinMap::kClassBits)
    value |= static_cast<std::uint32_t>(map.texel_classes[bit / 16 + 1]) << (16 - bit % 16);
  return value & (BinMap::kMaxClasses - 1);
}

void checkClasses(const BinMap& map, Findings& findings) {
  const auto& keys = map.class_keys;
  bool divide = keys.size() >= 2 && keys.size() <= BinMap::kMaxClasses + 1 && keys[0] == 0 && keys.back() == map.keyCount();
  for (std::size_t c = 1; divide && c < keys.size(); ++c) divide = keys[c] > keys[c - 1];
  if (!divide) {
    findings.add("bin_map.classes", "/class_keys", "does not rise from 0 to the number of keys");
    return;
  }
  for (std::size_t k = 0; k < texelCount(map); ++k) {
    if (classOf(map, k) < map.classCount()) continue;
    findings.add("bin_map.classes", "/texel_classes", "texel " + std::to_string(k) + " has a class that does not exist");
    return;
  }
}

/// Whether the texels of a block are of the map, in their bins' class, and not yet in `seen`.
bool listHolds(const BinMap& map, const BlockOfNode& block, std::vector<bool>& seen) {
  const TexelCode code_of_map = texelCode(map.width, map.height);
  const TexelCode code = blockCode(code_of_map, block.side_bits, block.cell_bits);
  const CellGrid grid = cellGrid(code_of_map, block.cell_bits);
  const std::uint32_t bin_shift = static_cast<std::uint32_t>(code.subbin_bits - block.side_bits);
  for (std::uint32_t cell = 0; cell < 1u << block.cell_bits; ++cell) {
    const std::uint32_t across = static_cast<std::uint32_t>(grid.columns);
    const std::uint32_t first_column = cell % across << grid.column_shift, first_row = cell / across << grid.row_shift;
    for (std::uint64_t k = map.cell_starts[block.first_cell + cell]; k < map.cell_starts[block.first_cell + cell + 1]; ++k) {
      const std::uint32_t code_of_texel = map.texels[k];
      const std::uint32_t column = first_column + code.column(code_of_texel), row = first_row + code.row(code_of_texel);
      if (column >= static_cast<std::uint32_t>(map.width) || row >= static_cast<std::uint32_t>(map.height)) return false;
      const int bin_column = block.column + static_cast<int>(code.subbinX(code_of_texel) >> bin_shift);
      const int bin_row = block.row + static_cast<int>(code.subbinY(code_of_texel) >> bin_shift);
      if (bin_column >= map.bins_per_axis || bin_row >= map.bins_per_axis) return false;
      const std::size_t texel = std::size_t{row} * static_cast<std::size_t>(map.width) + column;
      std::uint64_t key = block.first_key;
      for (int bit = 0; bit < block.side_bits; ++bit) {
        key += std::uint64_t{code.subbinX(code_of_texel) >> (bin_shift + static_cast<std::uint32_t>(bit)) & 1} << 2 * bit;
        key += std::uint64_t{code.subbinY(code_of_texel) >> (bin_shift + static_cast<std::uint32_t>(bit)) & 1} << (2 * bit + 1);
      }
      const std::uint32_t c = classOf(map, texel);
      if (seen[texel] || key < map.class_keys[c] || key >= map.class_keys[c + 1]) return false;
      seen[texel] = true;
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

/// Normals in a block have means in [0, 1] and variances of at most 1/4. Rounding to half precision moves each by 2^-11.
bool momentsHold(std::span<const std::uint16_t> moments) {
  double v[5];
  for (int k = 0; k < 5; ++k) v[k] = halfValue(moments[static_cast<std::size_t>(k)]);
  const auto between = [](double x, double low, double high) { return x >= low && x <= high; };
  return between(v[0], 0, 1) && between(v[1], 0, 1) && between(v[2], 0, 0.25) && between(v[4], 0, 0.25) &&
         v[3] * v[3] <= 1.01 * v[2] * v[4] + 1e-6;
}

}  // namespace

template <>
struct KindDescription<BinMap> {
  static constexpr std::string_view kTitle = "Inverse bin map";

  static std::vector<Rule> indexRules() {
    return {Rule{"bin_map.size", Severity::error, ErrorCode::unsupported,
                 "columns and rows of the map need at most 28 bits together", kMakeAgain},
            errorRule("bin_map.alpha", "alpha is between alpha_min and alpha_max"),
            errorRule("bin_map.cells", "cell_starts rise from 0 to the number of texels"),
            errorRule("bin_map.nodes", "nodes divide the bins in blocks of texels, numbered in order"),
            errorRule("bin_map.classes", "classes divide the keys of bins, and every texel has one")};
  }
  static std::vector<Rule> valueRules() {
    return {errorRule("bin_map.texels", "every texel of the map is listed once, in its class and in a bin of the square"),
            errorRule("bin_map.moments", "block_moments are those of a distribution inside the block")};
  }

  static void describe(Fields auto& fields, auto& map) {
    describeMapSize(fields, map);
    fields.real("alpha", map.alpha, kDiskUnits, "1", "Beckmann roughness that the bins are made for");
    fields.real("alpha_min", map.alpha_min, kDiskUnits, "1", "smallest Beckmann roughness of a facet");
    fields.real("alpha_max", map.alpha_max, kDiskUnits, "1", "largest Beckmann roughness of a facet");
    describeSlopes(fields, map.slopes);
    fields.integer("bins_per_axis", map.bins_per_axis, {1, 4096}, "1", "bins of directions along each axis of [-1, 1]^2");
    fields.integer("leaf_size", map.leaf_size, {1, 1024}, "texel",
                   "texels of a cell, on average at least, where a block is not sparse");
    fields.integer("tile_bits", map.tile_bits, {0, BinMap::kMaxTileBits}, "1",
                   "bins along each axis of a tile, logarithm to base 2");
    fields.integer("cell_starts_shift", map.cell_starts.shift, {0, CompactCounts::kMaxShift}, "1",
                   "values of cell_starts that share a base, logarithm to base 2");
    fields.array("nodes", map.nodes, {"node_count", "2"}, "1", "kind and block number, and first child or cell, of each node");
    fields.halves("block_moments", map.block_moments, {"block_count", "5"}, "1",
                  "mean x, y and covariance xx, xy, yy of the block's normals, in its sides from its lower left corner");
    fields.array("cell_starts/offsets", map.cell_starts.offsets, {"cell_bounds"}, "1",
                 "first texel of each cell, and their number, less its base");
    fields.array("cell_starts/bases", map.cell_starts.bases, {"ceil_div(cell_bounds, pow2(cell_starts_shift))"}, "1",
                 "bases of cell_starts");
    fields.array("texels", map.texels, {"height * width"}, "1",
                 "column and row in its cell and place in its block of each texel, listed by block and cell");
    fields.array("class_keys", map.class_keys, {"class_bounds"}, "1",
                 "first key of each class of bins, and the number of keys");
    fields.array("texel_classes", map.texel_classes, {"ceil_div(height * width * 12, 16)"}, "1",
                 "class of each texel of the map, 12 bits each");
  }

  static void checkIndex(const BinMap& map, Findings& findings) {
    if (!(map.alpha_min <= map.alpha && map.alpha <= map.alpha_max))
      findings.add("bin_map.alpha", "/@alpha", "is not between alpha_min and alpha_max");
    checkSlopes(map.slopes, findings);
    if (texelCode(map.width, map.height).subbin_bits < 0) {
      findings.add("bin_map.size", "/", "has " + std::to_string(map.width) + " x " + std::to_string(map.height) + " texels");
      return;
    }
    if (!startsHold(map)) {
      findings.add("bin_map.cells", "/cell_starts/offsets", "does not rise from 0 to the number of texels");
      return;
    }
    if (!TreeWalk(map).walk([](const BlockOfNode&) { return true; }))
      findings.add("bin_map.nodes", "/nodes", "does not divide the bins in blocks of texels, numbered in order");
    checkClasses(map, findings);
  }

  static void checkValues(const BinMap& map, Findings& findings) {
    std::vector<bool> seen(texelCount(map));
    std::size_t number = 0;
    const auto inOwnClass = [&](const BlockOfNode& block) {
      const std::size_t c = number++;
      const std::uint64_t end_key = block.first_key + (std::uint64_t{1} << 2 * block.side_bits);
      return block.first_key >= map.class_keys[c] && end_key <= map.class_keys[c + 1];
    };
    if (map.classCount() == map.blockCount() && !TreeWalk(map).walk(inOwnClass))
      findings.add("bin_map.classes", "/class_keys", "has as many classes as blocks, but not one for each");
    if (!TreeWalk(map).walk([&](const BlockOfNode& block) { return listHolds(map, block, seen); }))
      findings.add("bin_map.texels", "/texels", "does not list every texel once, in its class and in a bin of the square");
    for (std::size_t b = 0; b < map.blockCount(); ++b) {
      if (momentsHold(map.block_moments.subspan(5 * b, 5))) continue;
      findings.add("bin_map.moments", "/block_moments",
                   "block " + std::to_string(b) + " has moments of no distribution in a block");
      return;
    }
  }
};

template const Kind& kindOf<BinMap>();

}  // namespace glint::formats
