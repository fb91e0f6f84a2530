#pragma once

#include <cstddef>
#include <cstdint>
#include <span>

#include "glint/math/device.h"
#include "glint/model/map_slopes.h"

namespace glint {

/// A non-decreasing sequence of counts in little more than two bytes each: value k is bases[k >> shift] + offsets[k].
struct CompactCounts {
  std::span<const std::uint64_t> bases;    ///< [ceil(size / 2^shift)]
  std::span<const std::uint16_t> offsets;  ///< [size]
  int shift = 0;                           ///< 0 to kMaxShift

  static constexpr int kMaxShift = 6;

  GLINT_HD std::size_t size() const { return offsets.size(); }
  GLINT_HD std::uint64_t operator[](std::size_t k) const { return bases.data()[k >> shift] + offsets.data()[k]; }
};

/// Layout of a texel in 32 bits. Fields from the lowest bit on: column, row, and the column and row of the normal's sub-bin
/// in its block.
struct TexelCode {
  int column_bits = 0;
  int row_bits = 0;
  int subbin_bits = 0;  ///< along each axis

  static constexpr int kMaxPositionBits = 28;
  static constexpr int kMaxSubbinBits = 8;

  GLINT_HD constexpr std::uint32_t column(std::uint32_t code) const { return code & ((1u << column_bits) - 1); }
  GLINT_HD constexpr std::uint32_t row(std::uint32_t code) const { return code >> column_bits & ((1u << row_bits) - 1); }
  GLINT_HD constexpr std::uint32_t subbinX(std::uint32_t code) const {
    return code >> (column_bits + row_bits) & ((1u << subbin_bits) - 1);
  }
  GLINT_HD constexpr std::uint32_t subbinY(std::uint32_t code) const {
    return code >> (column_bits + row_bits + subbin_bits) & ((1u << subbin_bits) - 1);
  }
  GLINT_HD constexpr std::uint32_t pack(std::uint32_t column, std::uint32_t row, std::uint32_t x, std::uint32_t y) const {
    return column | row << column_bits | x << (column_bits + row_bits) | y << (column_bits + row_bits + subbin_bits);
  }
};

/// The layout with column and row in the whole map. The bits that remain are the largest number of bits of sub-bins. Maps whose
/// columns and rows need more than kMaxPositionBits together have no code: subbin_bits is -1.
GLINT_HD constexpr TexelCode texelCode(int width, int height) {
  const auto bits = [](int size) {
    int count = 0;
    while (((size - 1) >> count) != 0) ++count;
    return count;
  };
  TexelCode code{bits(width), bits(height), 0};
  const int left = 32 - code.column_bits - code.row_bits;
  code.subbin_bits = left < 32 - TexelCode::kMaxPositionBits ? -1
                     : left / 2 < TexelCode::kMaxSubbinBits  ? left / 2
                                                             : TexelCode::kMaxSubbinBits;
  return code;
}

/// Sizes of the cells of a block: 2^column_shift x 2^row_shift texels.
struct CellGrid {
  int column_shift = 0;
  int row_shift = 0;
  int columns = 1;
};

/// The grid of 2^cell_bits cells over a map. Cells are as square as powers of two allow.
/// @param cell_bits  at most column_bits + row_bits
GLINT_HD constexpr CellGrid cellGrid(const TexelCode& code, int cell_bits) {
  int across = (cell_bits + code.column_bits - code.row_bits + 1) / 2;
  if (cell_bits + code.column_bits < code.row_bits) across = 0;
  across = across > code.column_bits ? code.column_bits : across;
  across = across > cell_bits ? cell_bits : across;
  across = cell_bits - across > code.row_bits ? cell_bits - code.row_bits : across;
  return {code.column_bits - across, code.row_bits - (cell_bits - across), 1 << across};
}

/// Layout of the texels of a block of 2^side_bits x 2^side_bits bins with 2^cell_bits cells: column and row in the cell, sub-bin
/// in the block. A bin has 2^(subbin_bits - side_bits) sub-bins along each axis: as many as the texelCode of the map says, if
/// they fit. The difference is negative if not even the number of the bin fits.
GLINT_HD constexpr TexelCode blockCode(const TexelCode& map, int side_bits, int cell_bits) {
  const CellGrid grid = cellGrid(map, cell_bits);
  const int left = (32 - grid.column_shift - grid.row_shift) / 2 - side_bits;
  return {grid.column_shift, grid.row_shift, side_bits + (left < map.subbin_bits ? left : map.subbin_bits)};
}

/// The texels of a normal map, listed by the directions of their normals (Atanasov 2021, section 5.4).
///
/// The square [-1, 1]^2 has bins_per_axis^2 bins. A block is a square of 2^s x 2^s neighbouring bins, larger where few normals
/// are, with a list of the texels whose normals lie in it. Each block divides the map into a grid of 2^cell_bits cells
/// (`cellGrid`), and its list is sorted by cell, row by row. So a query reads little: few blocks have bins near a half vector,
/// and a small footprint meets one or two cells of each.
///
/// Blocks are the leaves of quadtrees. Each tile of 2^tile_bits x 2^tile_bits bins has a quadtree; tiles are numbered row by
/// row, and node number t is the root of tile t. The four children of a node are in the order (low column, low row), (high,
/// low), (low, high), (high, high). The *key* of a bin is its number in the order of the quadtrees; each tile has 4^tile_bits
/// keys.
struct BinMap {
  int width = 0;        ///< texels
  int height = 0;       ///< texels
  float alpha = 0;      ///< Beckmann roughness that the bins are made for; a facet's lobe has the deviation alpha / sqrt(2)
  float alpha_min = 0;  ///< roughnesses that may be asked for: alpha is between them, and the same where there is only one
  float alpha_max = 0;
  MapSlopes slopes;  ///< of the map's texels, for masking
  int bins_per_axis = 0;
  int leaf_size = 0;  ///< texels of a cell, on average at least, where a block is not sparse
  int tile_bits = 0;  ///< 0 to kMaxTileBits

  static constexpr int kMaxTileBits = 11;
  static constexpr std::uint32_t kEmpty = 0, kSplit = 63;  ///< kinds of nodes; others are blocks of 2^(kind - 1) cells
  static constexpr int kKindBits = 6;

  /// [nodes][2]: kind | number of the block << kKindBits, and the first of four children or of the block's cells. Tiles first
  std::span<const std::uint32_t> nodes;
  /// [blocks][5] of f16: mean (x, y) and covariance (xx, xy, yy) of the block's normals, from its lower left corner, in its
  /// sides
  std::span<const std::uint16_t> block_moments;
  CompactCounts cell_starts;              ///< [cells + 1]: first of `texels` of each cell, of all blocks in order
  std::span<const std::uint32_t> texels;  ///< [height * width]: blockCode

  /// Finding the block of a texel: bins are grouped in at most kMaxClasses classes of consecutive keys, and each texel stores
  /// its class.
  static constexpr int kClassBits = 12;
  static constexpr int kMaxClasses = 1 << kClassBits;
  std::span<const std::uint32_t> class_keys;     ///< [classes + 1]: first key of each class; then keyCount()
  std::span<const std::uint16_t> texel_classes;  ///< [ceil(height * width * 12 / 16)]: 12 bits a texel, rows of the map

  GLINT_HD int tilesPerAxis() const { return ((bins_per_axis - 1) >> tile_bits) + 1; }
  GLINT_HD std::uint64_t keyCount() const {
    return static_cast<std::uint64_t>(tilesPerAxis()) * static_cast<std::uint64_t>(tilesPerAxis()) << 2 * tile_bits;
  }
  GLINT_HD std::size_t blockCount() const { return block_moments.size() / 5; }
  GLINT_HD std::size_t classCount() const { return class_keys.size() - 1; }
};

}  // namespace glint
