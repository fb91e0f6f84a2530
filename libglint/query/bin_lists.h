#pragma once

#include <algorithm>
#include <cmath>
#include <cstdint>

#include "glint/model/bin_map.h"
#include "glint/query/bits.h"
#include "glint/query/texel_cover.h"

namespace glint {

/// The list of one occupied bin.
struct BinList {
  std::uint32_t bin = 0;      ///< number: row * bins_per_axis + column
  std::uint32_t ordinal = 0;  ///< among occupied bins
  std::int64_t grid = -1;     ///< number of its grid; -1 when it has none
  std::uint64_t begin = 0;    ///< first texel
  std::uint64_t end = 0;      ///< one past the last

  GLINT_HD std::uint64_t size() const { return end - begin; }
};

/// Consecutive texels of a list that may be in a footprint, and where they lie in its coordinates (TexelCover): texel (i, j) is at
/// (i - offset_x, j - offset_y), moved up by wrap_x and wrap_y where that is negative.
struct TexelRun {
  std::uint64_t begin = 0, end = 0;
  int offset_x = 0, offset_y = 0;
  int wrap_x = 0, wrap_y = 0;
};

/// Cells [first, end) of one row of a grid that a footprint meets; those of [whole, whole_end) are covered completely.
struct CellRow {
  std::uint32_t first, whole, whole_end, end;
  int offset_x, offset_y;
};

/// The cell rows of one footprint, kept for some sizes of grids: neighbouring bins have alike ones.
struct CellRows {
  static constexpr int kMost = 32;
  struct Grid {
    int cell_bits = -1;
    int count = 0;  ///< may be more than are kept
    CellRow rows[kMost];
  };
  Grid grids[4];
};

/// Finds bins, their texels and what of them a footprint covers. Allocates nothing; the map's arrays must outlive it.
class BinLists {
 public:
  GLINT_HD explicit BinLists(const BinMap& map) : map_(map), code_(texelCode(map.width, map.height)) {}

  GLINT_HD const BinMap& map() const { return map_; }
  GLINT_HD const TexelCode& code() const { return code_; }
  GLINT_HD std::uint32_t texel(std::uint64_t k) const { return map_.texels.data()[k]; }

  /// Calls visitor(bin, ordinal) for the occupied bins [first, end) of all bins, in their order.
  template <class Visitor>
  GLINT_HD void forEachOccupied(std::uint32_t first, std::uint32_t end, Visitor&& visitor) const {
    for (std::uint32_t word = first / 64; 64 * std::uint64_t{word} < end; ++word) {
      const std::uint64_t mask = map_.masks.data()[word];
      std::uint64_t bits = mask;
      if (word == first / 64) bits &= ~std::uint64_t{0} << (first % 64);
      if (word == (end - 1) / 64 && end % 64 != 0) bits &= (std::uint64_t{1} << (end % 64)) - 1;
      if (bits == 0) continue;
      auto ordinal = map_.mask_ranks.data()[word] + static_cast<std::uint32_t>(setBits(mask & ((bits & -bits) - 1)));
      for (; bits != 0; bits &= bits - 1) visitor(64 * word + static_cast<std::uint32_t>(std::countr_zero(bits)), ordinal++);
    }
  }

  GLINT_HD BinList list(std::uint32_t bin, std::uint32_t ordinal) const {
    const std::uint64_t mask = map_.grid_masks.data()[ordinal / 64], bit = std::uint64_t{1} << (ordinal % 64);
    const std::int64_t grid = std::int64_t{map_.grid_ranks.data()[ordinal / 64]} + setBits(mask & (bit - 1));
    return {bin, ordinal, mask & bit ? grid : -1, map_.bin_starts[ordinal], map_.bin_starts[ordinal + 1]};
  }

  /// Whether none of these occupied bins, at most 64, has a grid.
  GLINT_HD bool gridless(std::uint32_t first, int count) const {
    const std::uint64_t bits = ~std::uint64_t{0} >> (64 - count);
    const std::uint64_t* words = map_.grid_masks.data() + first / 64;
    const int shift = static_cast<int>(first % 64);
    if ((words[0] >> shift & bits) != 0) return false;
    return shift + count <= 64 || (words[1] & (bits >> (64 - shift))) == 0;
  }

  /// Splits the part of a list that may be in a footprint into runs: visitor.partial(TexelRun) where texels have to be looked at,
  /// visitor.whole(begin, end) where all are covered completely. A texel of a footprint larger than the map is met once for every
  /// period. O(cells along the border), O(texels) without a grid.
  /// @param rows  what was found for the last list of the same footprint
  template <class Visitor>
  GLINT_HD void forEachRun(const TexelCover& cover, const BinList& list, CellRows& rows, Visitor&& visitor) const {
    if (list.grid < 0) {
      forEachWholeListRun(cover, list.begin, list.end, visitor);
      return;
    }
    const std::uint32_t first = map_.grid_cells.data()[list.grid];
    const CellRows::Grid& grid = cellRows(cover, list, rows);
    if (grid.count > CellRows::kMost) {
      forEachCellRow(cover, grid.cell_bits, [&](const CellRow& row) { visitCellRow(first, row, visitor); });
    } else {
      for (int k = 0; k < grid.count; ++k) visitCellRow(first, grid.rows[k], visitor);
    }
  }

  /// The same for texels [begin, end) of lists without grids.
  template <class Visitor>
  GLINT_HD void forEachWholeListRun(const TexelCover& cover, std::uint64_t begin, std::uint64_t end, Visitor&& visitor) const {
    if (cover.fits()) {
      visitor.partial(TexelRun{begin, end, cover.originX(), cover.originY(), map_.width, map_.height});
      return;
    }
    forEachWindow(cover, [&](const Window& w) { visitor.partial(TexelRun{begin, end, w.offset_x, w.offset_y, 0, 0}); });
  }

  /// Asks for the cells of a list that a small footprint will need.
  GLINT_HD void prefetchCells(const TexelCover& cover, const BinList& list, CellRows& rows) const {
    const CellRows::Grid& grid = cellRows(cover, list, rows);
    const std::uint16_t* cells = map_.cell_starts.offsets.data() + map_.grid_cells.data()[list.grid];
    for (int k = 0; k < std::min(grid.count, 4); ++k) prefetch(cells + grid.rows[k].first);
  }

  /// The texel (column, row) in a list. It must be there or the first texel of the list is returned.
  GLINT_HD bool find(const BinList& list, std::uint32_t column, std::uint32_t row, std::uint32_t& found) const {
    std::uint64_t begin = list.begin, end = list.end;
    if (list.grid >= 0) {
      const std::uint32_t first = map_.grid_cells.data()[list.grid];
      const std::uint32_t end_cell = map_.grid_cells.data()[list.grid + 1];
      const CellGrid grid = cellGrid(code_, static_cast<int>(std::bit_width(end_cell - first - 1)) - 1);
      const std::uint32_t cell =
          first + (row >> grid.row_shift) * static_cast<std::uint32_t>(grid.columns) + (column >> grid.column_shift);
      begin = map_.cell_starts[cell], end = map_.cell_starts[cell + 1];
    }
    const std::uint32_t position = code_.pack(column, row, 0, 0);
    const std::uint32_t mask = (1u << (code_.column_bits + code_.row_bits)) - 1;
    for (std::uint64_t k = begin; k < end; ++k) {
      if ((texel(k) & mask) != position) continue;
      found = texel(k);
      return true;
    }
    return false;
  }

  /// Class of a texel.
  GLINT_HD std::uint32_t texelClass(std::uint64_t index) const {
    const std::uint64_t bit = index * BinMap::kClassBits;
    const std::uint16_t* words = map_.texel_classes.data() + bit / 16;
    const int shift = static_cast<int>(bit % 16);
    std::uint32_t value = static_cast<std::uint32_t>(words[0]) >> shift;
    if (shift > 16 - BinMap::kClassBits) value |= static_cast<std::uint32_t>(words[1]) << (16 - shift);
    return value & (BinMap::kMaxClasses - 1);
  }

 private:
  /// Columns and rows [.._begin, .._end) of the map, seen in one period.
  struct Window {
    int offset_x, offset_y, column_begin, column_end, row_begin, row_end;
  };

  /// The cell rows of a list with a grid.
  GLINT_HD const CellRows::Grid& cellRows(const TexelCover& cover, const BinList& list, CellRows& kept) const {
    const std::uint32_t* cells = map_.grid_cells.data() + list.grid;
    const int cell_bits = static_cast<int>(std::bit_width(cells[1] - cells[0] - 1)) - 1;
    CellRows::Grid& grid = kept.grids[cell_bits % 4];
    if (grid.cell_bits == cell_bits) return grid;
    grid.cell_bits = cell_bits;
    grid.count = 0;
    forEachCellRow(cover, cell_bits, [&](const CellRow& row) {
      if (grid.count < CellRows::kMost) grid.rows[grid.count] = row;
      ++grid.count;
    });
    return grid;
  }

  template <class Visitor>
  GLINT_HD void forEachWindow(const TexelCover& cover, Visitor&& visitor) const {
    for (int y = 0; y < cover.originY() + cover.rows(); y += map_.height) {
      for (int x = 0; x < cover.originX() + cover.columns(); x += map_.width) {
        visitor(Window{cover.originX() - x, cover.originY() - y, std::max(cover.originX() - x, 0),
                       std::min(cover.originX() + cover.columns() - x, map_.width), std::max(cover.originY() - y, 0),
                       std::min(cover.originY() + cover.rows() - y, map_.height)});
      }
    }
  }

  template <class Visitor>
  GLINT_HD void forEachCellRow(const TexelCover& cover, int cell_bits, Visitor&& visitor) const {
    const CellGrid grid = cellGrid(code_, cell_bits);
    forEachWindow(cover, [&](const Window& w) {
      for (int j = w.row_begin >> grid.row_shift; j <= (w.row_end - 1) >> grid.row_shift; ++j) {
        CoverSpan outer, inner;
        const int low = (j << grid.row_shift) - w.offset_y;
        cover.spans(low, low + (1 << grid.row_shift), outer, inner);
        const int begin = std::max(w.column_begin, floorTo(outer.low, cover.columns()) + w.offset_x);
        const int last = std::min(w.column_end, floorTo(outer.high, cover.columns()) + 1 + w.offset_x) - 1;
        if (outer.low > outer.high || begin > last) continue;
        const int c0 = begin >> grid.column_shift, c1 = (last >> grid.column_shift) + 1;
        // Whole cells [i0, i1): both sides rounded inwards.
        int i0 = c1, i1 = c1;
        if (inner.low <= inner.high) {
          const int first = static_cast<int>(std::ceil(inner.low)) + w.offset_x, end = static_cast<int>(std::floor(inner.high));
          i0 = std::clamp((first + (1 << grid.column_shift) - 1) >> grid.column_shift, c0, c1);
          i1 = std::clamp((end + w.offset_x) >> grid.column_shift, i0, c1);
        }
        const auto row = static_cast<std::uint32_t>(j) * static_cast<std::uint32_t>(grid.columns);
        visitor(CellRow{row + static_cast<std::uint32_t>(c0), row + static_cast<std::uint32_t>(i0),
                        row + static_cast<std::uint32_t>(i1), row + static_cast<std::uint32_t>(c1), w.offset_x, w.offset_y});
      }
    });
  }

  template <class Visitor>
  GLINT_HD void visitCellRow(std::uint32_t first_cell, const CellRow& row, Visitor&& visitor) const {
    const auto partial = [&](std::uint64_t from, std::uint64_t to) {
      if (from < to) visitor.partial(TexelRun{from, to, row.offset_x, row.offset_y, 0, 0});
    };
    const std::uint64_t begin = map_.cell_starts[first_cell + row.first], end = map_.cell_starts[first_cell + row.end];
    if (row.whole == row.whole_end) {
      partial(begin, end);
      return;
    }
    const std::uint64_t whole = map_.cell_starts[first_cell + row.whole];
    const std::uint64_t whole_end = map_.cell_starts[first_cell + row.whole_end];
    partial(begin, whole);
    if (whole < whole_end) visitor.whole(whole, whole_end);
    partial(whole_end, end);
  }

  /// Rounds down what is known to be near [0, limit].
  static GLINT_HD int floorTo(double x, int limit) { return static_cast<int>(std::floor(std::clamp(x, -1.0, limit + 1.0))); }

  BinMap map_;
  TexelCode code_;
};

}  // namespace glint
