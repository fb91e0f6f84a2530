#pragma once

#include <cstddef>
#include <cstdint>
#include <span>

#include "glint/model/device.h"
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

/// How a texel of a bin map is packed in 32 bits, from the lowest: column, row, and place in its bin along x and y.
struct TexelCode {
  int column_bits = 0;  ///< of width - 1
  int row_bits = 0;     ///< of height - 1
  int place_bits = 0;   ///< along each axis of a bin

  static constexpr int kMaxPositionBits = 28;
  static constexpr int kMaxPlaceBits = 8;

  GLINT_HD constexpr std::uint32_t column(std::uint32_t code) const { return code & ((1u << column_bits) - 1); }
  GLINT_HD constexpr std::uint32_t row(std::uint32_t code) const { return code >> column_bits & ((1u << row_bits) - 1); }
  GLINT_HD constexpr std::uint32_t placeX(std::uint32_t code) const {
    return code >> (column_bits + row_bits) & ((1u << place_bits) - 1);
  }
  GLINT_HD constexpr std::uint32_t placeY(std::uint32_t code) const {
    return code >> (column_bits + row_bits + place_bits) & ((1u << place_bits) - 1);
  }
  GLINT_HD constexpr std::uint32_t pack(std::uint32_t column, std::uint32_t row, std::uint32_t x, std::uint32_t y) const {
    return column | row << column_bits | x << (column_bits + row_bits) | y << (column_bits + row_bits + place_bits);
  }
};

/// The code of a map's texels. Maps whose columns and rows need more than kMaxPositionBits together have none: place_bits is
/// -1.
GLINT_HD constexpr TexelCode texelCode(int width, int height) {
  const auto bits = [](int size) {
    int count = 0;
    while (((size - 1) >> count) != 0) ++count;
    return count;
  };
  TexelCode code{bits(width), bits(height), 0};
  const int left = 32 - code.column_bits - code.row_bits;
  code.place_bits = left < 32 - TexelCode::kMaxPositionBits ? -1
                    : left / 2 < TexelCode::kMaxPlaceBits   ? left / 2
                                                            : TexelCode::kMaxPlaceBits;
  return code;
}

/// The texels of a normal map, listed by the bin of directions that their normals fall into (Atanasov 2021, section 5.4).
///
/// The square [-1, 1]^2 has bins_per_axis^2 bins; bin number = row * bins_per_axis + column. Only occupied bins have lists, in
/// the order of their numbers; the k-th of them is found from `masks` and `mask_ranks`. A bin of many texels has a grid of
/// cells over the map, a power of two of them, and its list is sorted by cell, row by row. Columns and rows of the map are cut
/// at multiples of powers of two, see `cellGrid`.
struct BinMap {
  int width = 0;        ///< texels
  int height = 0;       ///< texels
  float alpha = 0;      ///< Beckmann roughness that the bins are made for; a facet's lobe has the deviation alpha / sqrt(2)
  float alpha_min = 0;  ///< roughnesses that may be asked for: alpha is between them, and the same where there is only one
  float alpha_max = 0;
  MapSlopes slopes;  ///< of the map's texels, for masking
  int bins_per_axis = 0;
  int leaf_size = 0;  ///< texels of a cell, at least on average

  std::span<const std::uint64_t> masks;       ///< [ceil(bins_per_axis^2 / 64)]; bit b of word w: bin 64 w + b is occupied
  std::span<const std::uint32_t> mask_ranks;  ///< same shape: occupied bins before this word
  CompactCounts bin_starts;                   ///< [occupied bins + 1]: place in `texels` of each occupied bin
  std::span<const std::uint64_t> grid_masks;  ///< [ceil(occupied bins / 64)]; bit: the occupied bin has a grid
  std::span<const std::uint32_t> grid_ranks;  ///< same shape: grids before this word
  std::span<const std::uint32_t> grid_cells;  ///< [grids + 1]: place in `cell_starts`; a grid of n cells takes n + 1
  /// [grids][5] of f16: mean (x, y) and covariance (xx, xy, yy) of the bin's normals, from its lower left corner, in bin sides
  std::span<const std::uint16_t> grid_moments;
  CompactCounts cell_starts;              ///< places in `texels` of each cell and of the end of each grid's last
  std::span<const std::uint32_t> texels;  ///< [height * width]: TexelCode

  /// Bins are also grouped in at most kMaxClasses classes of consecutive numbers, for the way from a texel to its bin.
  static constexpr int kClassBits = 12;
  static constexpr int kMaxClasses = 1 << kClassBits;
  std::span<const std::uint32_t> class_bins;     ///< [classes + 1]: first bin number of each class; then the number of bins
  std::span<const std::uint16_t> texel_classes;  ///< [ceil(height * width * 12 / 16)]: 12 bits a texel, rows of the map

  GLINT_HD std::size_t binCount() const { return static_cast<std::size_t>(bins_per_axis) * bins_per_axis; }
  GLINT_HD std::size_t occupiedBins() const { return bin_starts.size() - 1; }
  GLINT_HD std::size_t classCount() const { return class_bins.size() - 1; }
};

/// Sizes of the cells of a bin's grid: 2^column_shift x 2^row_shift texels.
struct CellGrid {
  int column_shift = 0;
  int row_shift = 0;
  int columns = 1;
};

/// The grid of 2^cell_bits cells over a map: cells as square as powers of two allow.
/// @param cell_bits  at most column_bits + row_bits
GLINT_HD constexpr CellGrid cellGrid(const TexelCode& code, int cell_bits) {
  int across = (cell_bits + code.column_bits - code.row_bits + 1) / 2;
  if (cell_bits + code.column_bits < code.row_bits) across = 0;
  across = across > code.column_bits ? code.column_bits : across;
  across = across > cell_bits ? cell_bits : across;
  across = cell_bits - across > code.row_bits ? cell_bits - code.row_bits : across;
  return {code.column_bits - across, code.row_bits - (cell_bits - across), 1 << across};
}

}  // namespace glint
