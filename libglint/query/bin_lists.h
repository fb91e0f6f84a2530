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

/// A texel found in its list.
struct BinTexel {
  std::uint32_t bin = 0;      ///< number
  std::uint32_t ordinal = 0;  ///< of the bin among occupied ones
  std::uint32_t code = 0;     ///< TexelCode
};

/// Consecutive texels of a list that may be in a footprint, and where they lie in its coordinates (TexelCover): texel (i, j) is at
/// (i - offset_x, j - offset_y), moved up by wrap_x and wrap_y where that is negative.
struct TexelRun {
  std::uint64_t begin = 0, end = 0;
  int offset_x = 0, offset_y = 0;
  int wrap_x = 0, wrap_y = 0;
  /// For boxes along the axes: no texel is cut by the sides along v (or u), and none wraps.
  bool inside_x = false, inside_y = false;
  bool rare = false;  ///< few of these texels are expected to be in the footprint
};

/// Cells [first, end) of one row of a grid that a footprint meets; those of [whole, whole_end) are covered completely, or along u only
/// if not `inside_y`.
struct CellRow {
  std::uint32_t first, whole, whole_end, end;
  int offset_x, offset_y;
  bool inside_y;
  bool rare;  ///< the footprint is so small beside a cell that few texels are expected in it
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

  /// Looks for the texel (column, row) among those of bins [first, end), at most the bins of a class.
  GLINT_HD bool find(std::uint32_t first, std::uint32_t end, std::uint32_t column, std::uint32_t row, BinTexel& found) const {
    const std::uint32_t begin = occupiedBefore(first), last = occupiedBefore(end);
    for (std::uint32_t ordinal = begin; ordinal < last;) {
      // Lists without grids are read as one.
      const int count = static_cast<int>(std::min<std::uint32_t>(64, last - ordinal)),
                joined = gridless(ordinal, count) ? count : 1;
      std::uint64_t from = map_.bin_starts[ordinal], to = map_.bin_starts[ordinal + static_cast<std::uint32_t>(joined)];
      if (joined == 1) limitToCell(list(0, ordinal), column, row, from, to);
      if (const std::uint64_t k = findCode(from, to, code_.pack(column, row, 0, 0)); k < to) {
        while (map_.bin_starts[ordinal + 1] <= k) ++ordinal;
        found = {occupiedBin(first, ordinal - begin), ordinal, texel(k)};
        return true;
      }
      ordinal += static_cast<std::uint32_t>(joined);
    }
    return false;
  }

  /// The class of a bin. O(log classes).
  GLINT_HD std::uint32_t classOf(std::uint32_t bin) const {
    std::uint32_t low = 0, count = static_cast<std::uint32_t>(map_.classCount());
    while (count > 1) {  // the class is in [low, low + count)
      const std::uint32_t half = count / 2;
      low += map_.class_bins.data()[low + half] <= bin ? half : 0;
      count -= half;
    }
    return low;
  }

  /// Most texels that `texelsOfClasses` answers at once.
  static constexpr int kMostAtOnce = 60;

  /// Bit k: the class of texel index + k is in [first, last], for 0 <= k < count <= kMostAtOnce, all of one row of the map.
  GLINT_HD std::uint64_t texelsOfClasses(std::uint64_t index, int count, std::uint32_t first, std::uint32_t last) const {
    // Four texels at a time, each in 16 bits of a word: additions carry into the highest of these for c >= first, and for c > last.
    constexpr std::uint64_t kOnes = 0x0001000100010001, kHighest = kOnes << 15;
    const std::uint64_t below = (0x8000 - first) * kOnes, above = (0x7fff - last) * kOnes;
    const int head = static_cast<int>(index % 4), end = head + count;
    const std::uint64_t begin = index - static_cast<std::uint64_t>(head);
    std::uint64_t bits = 0;
    for (int k = 0; k < end; k += 4) {
      const std::uint64_t lanes = fourClasses(begin + static_cast<std::uint64_t>(k));
      const std::uint64_t in = (lanes + below) & ~(lanes + above) & kHighest;
      if (in == 0) continue;
      constexpr std::uint64_t kGather = 1ull << 48 | 1ull << 33 | 1ull << 18 | 1ull << 3;  // the four bits to bits 48 to 51
      bits |= ((in >> 15) * kGather >> 48 & 15) << k;
    }
    return bits >> head & ((std::uint64_t{1} << count) - 1);
  }

  /// Visits the classes of texels index + k, 0 <= k < count, of one row of the map: one(k, class) or four(k, and four classes).
  template <class One, class Four>
  GLINT_HD void forEachClass(std::uint64_t index, int count, One&& one, Four&& four) const {
    constexpr std::uint64_t kMask = BinMap::kMaxClasses - 1;
    int k = 0;
    for (; k < count && (index + static_cast<std::uint64_t>(k)) % 4 != 0; ++k)
      one(k, texelClass(index + static_cast<std::uint64_t>(k)));
    // Four texels fill three words.
    const std::uint16_t* words = map_.texel_classes.data() + (index + static_cast<std::uint64_t>(k)) / 4 * 3;
    for (; k + 4 <= count; k += 4, words += 3) {
      const std::uint64_t packed = words[0] | std::uint64_t{words[1]} << 16 | std::uint64_t{words[2]} << 32;
      four(k, static_cast<std::uint32_t>(packed & kMask), static_cast<std::uint32_t>(packed >> BinMap::kClassBits & kMask),
           static_cast<std::uint32_t>(packed >> 2 * BinMap::kClassBits & kMask),
           static_cast<std::uint32_t>(packed >> 3 * BinMap::kClassBits & kMask));
    }
    for (; k < count; ++k) one(k, texelClass(index + static_cast<std::uint64_t>(k)));
  }

  GLINT_HD void prefetchClass(std::uint64_t index) const {
    prefetch(map_.texel_classes.data() + index * BinMap::kClassBits / 16);
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
  /// Classes of texels index to index + 3, a multiple of four, in 16 bits each; 0 beyond the map.
  GLINT_HD std::uint64_t fourClasses(std::uint64_t index) const {
    constexpr int kBits = BinMap::kClassBits;
    constexpr std::uint64_t kMask = BinMap::kMaxClasses - 1;
    const std::uint64_t first = index / 4 * 3, left = map_.texel_classes.size() - first;
    const std::uint16_t* words = map_.texel_classes.data() + first;
    const std::uint64_t packed =
        words[0] | (left > 1 ? std::uint64_t{words[1]} << 16 : 0) | (left > 2 ? std::uint64_t{words[2]} << 32 : 0);
    return (packed & kMask) | (packed & kMask << kBits) << 4 | (packed & kMask << 2 * kBits) << 8 |
           (packed & kMask << 3 * kBits) << 12;
  }

  /// Occupied bins before a bin; `bin` may be the number of bins.
  GLINT_HD std::uint32_t occupiedBefore(std::uint32_t bin) const {
    if (bin == map_.binCount()) return static_cast<std::uint32_t>(map_.occupiedBins());
    const std::uint64_t below = (std::uint64_t{1} << (bin % 64)) - 1;
    return map_.mask_ranks.data()[bin / 64] + static_cast<std::uint32_t>(setBits(map_.masks.data()[bin / 64] & below));
  }

  /// The n-th occupied bin from bin `first` on; there must be one.
  GLINT_HD std::uint32_t occupiedBin(std::uint32_t first, std::uint32_t n) const {
    std::uint32_t word = first / 64;
    std::uint64_t bits = map_.masks.data()[word] & ~std::uint64_t{0} << (first % 64);
    for (auto here = static_cast<std::uint32_t>(setBits(bits)); n >= here; here = static_cast<std::uint32_t>(setBits(bits))) {
      n -= here;
      bits = map_.masks.data()[++word];
    }
    for (; n > 0; --n) bits &= bits - 1;
    return 64 * word + static_cast<std::uint32_t>(lowestBit(bits));
  }

  /// Shortens [from, to), a list, to the cell that a texel is in, if there are cells.
  GLINT_HD void limitToCell(const BinList& list, std::uint32_t column, std::uint32_t row, std::uint64_t& from,
                            std::uint64_t& to) const {
    if (list.grid < 0) return;
    const std::uint32_t first = map_.grid_cells.data()[list.grid], end = map_.grid_cells.data()[list.grid + 1];
    const CellGrid grid = cellGrid(code_, static_cast<int>(std::bit_width(end - first - 1)) - 1);
    const std::uint32_t cell =
        first + (row >> grid.row_shift) * static_cast<std::uint32_t>(grid.columns) + (column >> grid.column_shift);
    from = map_.cell_starts[cell], to = map_.cell_starts[cell + 1];
  }

  /// Place in [from, to) of the texel at a position, `to` if it is not there.
  GLINT_HD std::uint64_t findCode(std::uint64_t from, std::uint64_t to, std::uint32_t position) const {
    constexpr std::uint64_t kBlock = 16;
    const std::uint32_t mask = (1u << (code_.column_bits + code_.row_bits)) - 1;
    for (std::uint64_t k = from; k < to; k += kBlock) {
      const std::uint64_t end = std::min(k + kBlock, to);
      std::uint32_t found = 0;
      for (std::uint64_t i = k; i < end; ++i) found |= static_cast<std::uint32_t>((texel(i) & mask) == position);
      if (found == 0) continue;
      while ((texel(k) & mask) != position) ++k;
      return k;
    }
    return to;
  }

  static constexpr double kTexelsOfACell = 16;

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
    const bool rare = 2 * kTexelsOfACell * cover.area() < static_cast<double>(1u << (grid.column_shift + grid.row_shift));
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
        const bool inside_y = inner.low <= inner.high;
        if (!inside_y && cover.aligned()) inner = outer;
        if (inner.low <= inner.high) {
          const int first = static_cast<int>(std::ceil(inner.low)) + w.offset_x, end = static_cast<int>(std::floor(inner.high));
          i0 = std::clamp((first + (1 << grid.column_shift) - 1) >> grid.column_shift, c0, c1);
          i1 = std::clamp((end + w.offset_x) >> grid.column_shift, i0, c1);
        }
        const auto row = static_cast<std::uint32_t>(j) * static_cast<std::uint32_t>(grid.columns);
        visitor(CellRow{row + static_cast<std::uint32_t>(c0), row + static_cast<std::uint32_t>(i0),
                        row + static_cast<std::uint32_t>(i1), row + static_cast<std::uint32_t>(c1), w.offset_x, w.offset_y,
                        inside_y, rare});
      }
    });
  }

  template <class Visitor>
  GLINT_HD void visitCellRow(std::uint32_t first_cell, const CellRow& row, Visitor&& visitor) const {
    const auto partial = [&](std::uint64_t from, std::uint64_t to, bool inside_x, bool inside_y) {
      if (from < to) visitor.partial(TexelRun{from, to, row.offset_x, row.offset_y, 0, 0, inside_x, inside_y, row.rare});
    };
    const std::uint64_t begin = map_.cell_starts[first_cell + row.first], end = map_.cell_starts[first_cell + row.end];
    constexpr std::uint32_t kWorthSplitting = 4;  // cells
    if (row.whole + (row.inside_y ? 0 : kWorthSplitting) >= row.whole_end) {
      partial(begin, end, false, row.inside_y);
      return;
    }
    const std::uint64_t whole = map_.cell_starts[first_cell + row.whole];
    const std::uint64_t whole_end = map_.cell_starts[first_cell + row.whole_end];
    partial(begin, whole, false, row.inside_y);
    if (!row.inside_y)
      partial(whole, whole_end, true, false);
    else if (whole < whole_end)
      visitor.whole(whole, whole_end);
    partial(whole_end, end, false, row.inside_y);
  }

  /// Rounds down what is known to be near [0, limit].
  static GLINT_HD int floorTo(double x, int limit) { return static_cast<int>(std::floor(std::clamp(x, -1.0, limit + 1.0))); }

  BinMap map_;
  TexelCode code_;
};

}  // namespace glint
