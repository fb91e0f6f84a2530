#pragma once

#include <algorithm>
#include <cmath>
#include <cstdint>

#include "glint/math/bits.h"
#include "glint/math/device.h"
#include "glint/model/bin_map.h"
#include "glint/query/detail/bin_map/texel_cover.h"

namespace glint {

/// A rectangle of bins: columns and rows from `begin` to before `end`.
struct BinRect {
  int column_begin = 0, column_end = 0, row_begin = 0, row_end = 0;

  GLINT_HD bool meets(int column, int row, int side) const {
    return column < column_end && column + side > column_begin && row < row_end && row + side > row_begin;
  }
};

/// A block: a square of 2^side_bits x 2^side_bits bins with a list of its texels.
struct BinBlock {
  int column, row;  ///< lowest column and row of its bins
  int side_bits;
  int cell_bits;             ///< the list is divided into 2^cell_bits cells
  std::uint32_t first_cell;  ///< number of its first cell among the cells of all blocks
  std::uint32_t number;      ///< number of the block

  GLINT_HD int side() const { return 1 << side_bits; }
};

/// A texel and the block whose list has it.
struct BinTexel {
  BinBlock block;
  std::uint32_t code = 0;  ///< packed as blockCode says
};

/// Consecutive texels of a block's list, from number `begin` to before `end`. The footprint may cover some of them only in
/// part, or not at all. Column and row of a code, plus (x, y), are coordinates of the footprint (TexelCover).
struct TexelRun {
  std::uint64_t begin, end;
  int x, y;
  bool cut_x, cut_y;  ///< whether the footprint may begin or end inside the cells, along u and along v; else x, y is unused
};

/// Cells of one row of a block's grid that a footprint meets: from `first` to before `end`. Cells from `whole` to before
/// `whole_end` are covered along their whole width; along their height only if not `cut_y`.
struct CellRow {
  std::uint32_t first, whole, whole_end, end;
  int x, y;  ///< coordinates of cell `first` in the footprint
  bool cut_y;
};

/// A cache of the cell rows of one footprint. Rows depend only on the number of cells of a block, which neighbouring blocks
/// often share.
struct CellRows {
  static constexpr int kMost = 32;
  struct Grid {
    int cell_bits = -1;
    int count = 0;  ///< rows that the footprint meets; if more than kMost, `rows` is incomplete
    CellRow rows[kMost];
  };
  Grid grids[4];
};

/// Finds the blocks of some bins, and the texels of a block that a footprint covers. Allocates nothing; the map's arrays must
/// outlive it.
class BinBlocks {
 public:
  GLINT_HD explicit BinBlocks(const BinMap& map)
      : map_(map), code_(texelCode(map.width, map.height)), tiles_(map.tilesPerAxis()) {}

  GLINT_HD const BinMap& map() const { return map_; }
  GLINT_HD std::uint32_t texel(std::uint64_t k) const { return map_.texels.data()[k]; }
  /// How the texels of a block are packed.
  GLINT_HD TexelCode code(const BinBlock& block) const { return blockCode(code_, block.side_bits, block.cell_bits); }
  /// The list of a block: `texel` numbers from begin(block) to before end(block).
  GLINT_HD std::uint64_t begin(const BinBlock& block) const { return map_.cell_starts[block.first_cell]; }
  GLINT_HD std::uint64_t end(const BinBlock& block) const {
    return map_.cell_starts[block.first_cell + (std::uint64_t{1} << block.cell_bits)];
  }

  /// Asks the memory for the tiles of some bins.
  GLINT_HD void prefetchTiles(const BinRect& bins) const {
    forEachTile(bins, [&](int column, int row) { prefetch(node(tileOf(column, row))); });
  }

  /// Calls visitor(BinBlock) for the blocks that contain some bins.
  template <class Visitor>
  GLINT_HD void forEachBlock(const BinRect& bins, Visitor&& visitor) const {
    forEachTile(bins, [&](int column, int row) {
      const int bits = map_.tile_bits;
      visitTile(tileOf(column, row), {column << bits, row << bits, bits, 0, 0, 0}, bins, visitor);
    });
  }

  /// Splits the part of a block's list that a footprint can meet into runs. Calls visitor.whole(begin, end) for texels that are
  /// covered completely, and visitor.partial(TexelRun) for texels that the visitor must look at one by one. Under a footprint
  /// larger than the map, a texel is in one run for every period that covers it. O(cells along the border).
  /// @param kept  cache for this footprint, shared between blocks
  template <class Visitor>
  GLINT_HD void forEachRun(const TexelCover& cover, const BinBlock& block, CellRows& kept, Visitor&& visitor) const {
    forEachPiece(cover, block, kept, [&](const Piece& piece) { visitPiece(block.first_cell, piece, visitor); });
  }

  /// Splits the lists of several blocks into runs, cell by cell: runs of the same cell follow one another. Calls
  /// visitor.select(block) before runs of that block.
  /// @param blocks  elements have a member BinBlock `block`
  /// @param count   at most 31
  template <class Block, class Visitor>
  GLINT_HD void forEachRun(const TexelCover& cover, const Block* blocks, int count, CellRows& kept, Visitor&& visitor) const {
    std::uint32_t left = (1u << count) - 1;
    while (left != 0) {
      const BinBlock& first = blocks[lowestBit(left)].block;
      std::uint32_t alike = 0;
      for (std::uint32_t rest = left; rest != 0; rest &= rest - 1) {
        const int k = lowestBit(rest);
        if (blocks[k].block.cell_bits == first.cell_bits) alike |= 1u << k;
      }
      left &= ~alike;
      forEachPiece(cover, first, kept, [&](const Piece& piece) {
        for (std::uint32_t rest = alike; rest != 0; rest &= rest - 1) {
          const int k = lowestBit(rest);
          visitor.select(blocks[k]);
          visitPiece(blocks[k].block.first_cell, piece, visitor);
        }
      });
    }
  }

  /// Asks the memory for the cells of a block that a small footprint will need.
  GLINT_HD void prefetchCells(const TexelCover& cover, const BinBlock& block, CellRows& kept) const {
    const CellRows::Grid& grid = cellRows(cover, block, kept);
    for (int k = 0; k < std::min(grid.count, 4); ++k) {
      const std::uint64_t cell = std::uint64_t{block.first_cell} + grid.rows[k].first;
      prefetch(map_.cell_starts.offsets.data() + cell);
      prefetch(map_.cell_starts.bases.data() + (cell >> map_.cell_starts.shift));
    }
  }

  /// Looks for the texel (column, row) in the blocks of a class that have bins in `bins`.
  GLINT_HD bool find(std::uint32_t texel_class, std::uint32_t column, std::uint32_t row, const BinRect& bins,
                     BinTexel& found) const {
    const std::uint64_t end = map_.class_keys.data()[texel_class + 1];
    for (std::uint64_t key = map_.class_keys.data()[texel_class]; key < end;) {
      const bool occupied = blockAt(key, found.block);
      const int bits = 2 * found.block.side_bits;
      key = ((key >> bits) + 1) << bits;
      if (occupied && bins.meets(found.block.column, found.block.row, found.block.side()) &&
          findIn(found.block, column, row, found.code))
        return true;
    }
    return false;
  }

  /// Looks for the texel (column, row) in a block.
  GLINT_HD bool findIn(const BinBlock& block, std::uint32_t column, std::uint32_t row, std::uint32_t& texel_code) const {
    const CellGrid grid = cellGrid(code_, block.cell_bits);
    const std::uint64_t cell = block.first_cell +
                               std::uint64_t{row >> grid.row_shift} * static_cast<std::uint64_t>(grid.columns) +
                               (column >> grid.column_shift);
    const std::uint64_t k = findCode(map_.cell_starts[cell], map_.cell_starts[cell + 1], code(block), column, row);
    if (k == kNowhere) return false;
    texel_code = texel(k);
    return true;
  }

  /// Key of the first bin of a tile; if `past`, of the first bin of the next tile.
  GLINT_HD std::uint32_t tileKey(int bin_column, int bin_row, bool past) const {
    return (tileOf(bin_column >> map_.tile_bits, bin_row >> map_.tile_bits) + (past ? 1 : 0)) << 2 * map_.tile_bits;
  }

  /// The class that has a key; O(log classes).
  GLINT_HD std::uint32_t classOf(std::uint32_t key) const {
    std::uint32_t low = 0, count = static_cast<std::uint32_t>(map_.classCount());
    while (count > 1) {  // the class is in [low, low + count)
      const std::uint32_t half = count / 2;
      low += map_.class_keys.data()[low + half] <= key ? half : 0;
      count -= half;
    }
    return low;
  }

  /// Most texels that `texelsOfClasses` answers at once.
  static constexpr int kMostAtOnce = 60;

  /// Bit k, for k < count: whether the class of texel index + k is in [first, last].
  /// @param count  at most kMostAtOnce; all texels are in one row of the map
  GLINT_HD std::uint64_t texelsOfClasses(std::uint64_t index, int count, std::uint32_t first, std::uint32_t last) const {
    // Takes four texels at a time, each in 16 bits of a word. The first sum below sets the highest of the 16 bits where the
    // class is >= first, the second sum where the class is > last.
    constexpr std::uint64_t kOnes = 0x0001000100010001, kHighest = kOnes << 15;
    const std::uint64_t below = (0x8000 - first) * kOnes, above = (0x7fff - last) * kOnes;
    const int head = static_cast<int>(index % 4), end = head + count;
    const std::uint64_t begin = index - static_cast<std::uint64_t>(head);
    std::uint64_t bits = 0;
    for (int k = 0; k < end; k += 4) {
      const std::uint64_t lanes = fourClasses(begin + static_cast<std::uint64_t>(k));
      const std::uint64_t in = (lanes + below) & ~(lanes + above) & kHighest;
      if (in == 0) continue;
      constexpr std::uint64_t kGather =
          1ull << 48 | 1ull << 33 | 1ull << 18 | 1ull << 3;  // moves the four bits to bits 48 to 51
      bits |= ((in >> 15) * kGather >> 48 & 15) << k;
    }
    return bits >> head & ((std::uint64_t{1} << count) - 1);
  }

  /// Visits the classes of `count` texels of one row of the map, from `index` on: calls one(k, class of index + k), or
  /// four(k, classes of index + k to index + k + 3).
  template <class One, class Four>
  GLINT_HD void forEachClass(std::uint64_t index, int count, One&& one, Four&& four) const {
    constexpr std::uint64_t kMask = BinMap::kMaxClasses - 1;
    int k = 0;
    for (; k < count && (index + static_cast<std::uint64_t>(k)) % 4 != 0; ++k)
      one(k, texelClass(index + static_cast<std::uint64_t>(k)));
    // The classes of four texels fill three words.
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
  GLINT_HD const std::uint32_t* node(std::uint32_t k) const { return map_.nodes.data() + 2 * std::size_t{k}; }
  GLINT_HD std::uint32_t tileOf(int column, int row) const { return static_cast<std::uint32_t>(row * tiles_ + column); }

  template <class Visitor>
  GLINT_HD void forEachTile(const BinRect& bins, Visitor&& visitor) const {
    const int bits = map_.tile_bits;
    for (int row = bins.row_begin >> bits; row <= (bins.row_end - 1) >> bits; ++row)
      for (int column = bins.column_begin >> bits; column <= (bins.column_end - 1) >> bits; ++column) visitor(column, row);
  }

  /// Fills a block from its node; false if the node is no block.
  static GLINT_HD bool isBlock(const std::uint32_t* node, BinBlock& block) {
    const std::uint32_t kind = node[0] & ((1u << BinMap::kKindBits) - 1);
    if (kind == BinMap::kEmpty) return false;
    block.cell_bits = static_cast<int>(kind) - 1;
    block.number = node[0] >> BinMap::kKindBits;
    block.first_cell = node[1];
    return true;
  }
  static GLINT_HD bool isSplit(const std::uint32_t* node) {
    return (node[0] & ((1u << BinMap::kKindBits) - 1)) == BinMap::kSplit;
  }
  /// Turns the square of a node into the square of its child.
  static GLINT_HD void descend(BinBlock& block, std::uint32_t quadrant) {
    --block.side_bits;
    block.column += static_cast<int>(quadrant & 1) << block.side_bits;
    block.row += static_cast<int>(quadrant >> 1) << block.side_bits;
  }

  /// Visits the blocks of a tile, whose bins are those of `square`. Not recursive: compilers for GPUs could not bound the stack.
  template <class Visitor>
  GLINT_HD void visitTile(std::uint32_t tile, const BinBlock& square, const BinRect& bins, Visitor& visitor) const {
    struct Pending {
      std::uint32_t node;
      BinBlock block;
    };
    // Each split leaves at most three siblings behind.
    Pending pending[3 * BinMap::kMaxTileBits + 1];
    pending[0] = {tile, square};
    for (int count = 1; count > 0;) {
      Pending next = pending[--count];
      const std::uint32_t* here = node(next.node);
      if (!isSplit(here)) {
        if (isBlock(here, next.block)) visitor(next.block);
        continue;
      }
      for (std::uint32_t quadrant = 4; quadrant-- > 0;) {  // pushed last, quadrant 0 is taken next
        BinBlock child = next.block;
        descend(child, quadrant);
        if (bins.meets(child.column, child.row, child.side())) pending[count++] = {here[1] + quadrant, child};
      }
    }
  }

  /// Finds the leaf that has a key: false if it has no normals, and then `block` is only its square.
  GLINT_HD bool blockAt(std::uint64_t key, BinBlock& block) const {
    const auto tile = static_cast<std::uint32_t>(key >> 2 * map_.tile_bits), across = static_cast<std::uint32_t>(tiles_);
    block.column = static_cast<int>(tile % across) << map_.tile_bits, block.row = static_cast<int>(tile / across)
                                                                                  << map_.tile_bits;
    block.side_bits = map_.tile_bits;
    const std::uint32_t* here = node(tile);
    while (isSplit(here)) {
      const std::uint32_t quadrant = static_cast<std::uint32_t>(key >> 2 * (block.side_bits - 1)) & 3;
      descend(block, quadrant);
      here = node(here[1] + quadrant);
    }
    return isBlock(here, block);
  }

  static constexpr std::uint64_t kNowhere = ~std::uint64_t{0};

  /// Number in [from, to) of the texel that has a column and row; kNowhere if there is none.
  GLINT_HD std::uint64_t findCode(std::uint64_t from, std::uint64_t to, const TexelCode& code, std::uint32_t column,
                                  std::uint32_t row) const {
    constexpr std::uint64_t kRun = 16;
    const auto mask = static_cast<std::uint32_t>((std::uint64_t{1} << (code.column_bits + code.row_bits)) - 1);
    const std::uint32_t position = code.pack(column & ((1u << code.column_bits) - 1), row & ((1u << code.row_bits) - 1), 0, 0);
    for (std::uint64_t k = from; k < to; k += kRun) {
      const std::uint64_t end = std::min(k + kRun, to);
      std::uint32_t found = 0;
      for (std::uint64_t i = k; i < end; ++i) found |= static_cast<std::uint32_t>((texel(i) & mask) == position);
      if (found == 0) continue;
      while ((texel(k) & mask) != position) ++k;
      return k;
    }
    return kNowhere;
  }

  /// Classes of texels index to index + 3 in 16 bits each; 0 beyond the map.
  /// @param index  a multiple of four
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

  /// The part of the map that a footprint's bounding box covers in one period. Offsets lead from coordinates of the footprint
  /// to columns and rows of the map.
  struct Window {
    int offset_x, offset_y, column_begin, column_end, row_begin, row_end;
  };

  /// The cell rows of a block, from the cache or added to it.
  GLINT_HD const CellRows::Grid& cellRows(const TexelCover& cover, const BinBlock& block, CellRows& kept) const {
    CellRows::Grid& grid = kept.grids[block.cell_bits % 4];
    if (grid.cell_bits == block.cell_bits) return grid;
    grid.cell_bits = block.cell_bits;
    grid.count = 0;
    forEachCellRow(cover, cellGrid(code_, block.cell_bits), [&](const CellRow& row) {
      if (grid.count < CellRows::kMost) grid.rows[grid.count] = row;
      ++grid.count;
    });
    return grid;
  }

  template <class Visitor>
  GLINT_HD void forEachWindow(const TexelCover& cover, Visitor&& visitor) const {
    for (int y = 0; y < cover.originY() + cover.rows(); y += map_.height) {
      // A slanted footprint misses most periods of its bounding box: its columns in these rows tell which.
      CoverSpan outer, inner;
      cover.spans(std::max(y - cover.originY(), 0), y + map_.height - cover.originY(), outer, inner);
      const int first = floorTo(outer.low, cover.columns()) + cover.originX(), last = floorTo(outer.high, cover.columns());
      for (int x = std::max(0, first - first % map_.width); x <= last + cover.originX(); x += map_.width) {
        if (x >= cover.originX() + cover.columns()) break;
        visitor(Window{cover.originX() - x, cover.originY() - y, std::max(cover.originX() - x, 0),
                       std::min(cover.originX() + cover.columns() - x, map_.width), std::max(cover.originY() - y, 0),
                       std::min(cover.originY() + cover.rows() - y, map_.height)});
      }
    }
  }

  template <class Visitor>
  GLINT_HD void forEachCellRow(const TexelCover& cover, const CellGrid& grid, Visitor&& visitor) const {
    forEachWindow(cover, [&](const Window& w) {
      for (int j = w.row_begin >> grid.row_shift; j <= (w.row_end - 1) >> grid.row_shift; ++j) {
        CoverSpan outer, inner;
        const int low = (j << grid.row_shift) - w.offset_y;
        cover.spans(low, low + (1 << grid.row_shift), outer, inner);
        const int begin = std::max(w.column_begin, floorTo(outer.low, cover.columns()) + w.offset_x);
        const int last = std::min(w.column_end, floorTo(outer.high, cover.columns()) + 1 + w.offset_x) - 1;
        if (outer.low > outer.high || begin > last) continue;
        const int c0 = begin >> grid.column_shift, c1 = (last >> grid.column_shift) + 1;
        // Cells i0 to before i1 are covered along their width: both ends are rounded inwards.
        int i0 = c1, i1 = c1;
        const bool cut_y = inner.low > inner.high;
        if (cut_y && cover.aligned()) inner = outer;
        if (inner.low <= inner.high) {
          const int first = static_cast<int>(std::ceil(inner.low)) + w.offset_x, end = static_cast<int>(std::floor(inner.high));
          i0 = std::clamp((first + (1 << grid.column_shift) - 1) >> grid.column_shift, c0, c1);
          i1 = std::clamp((end + w.offset_x) >> grid.column_shift, i0, c1);
        }
        const auto row = static_cast<std::uint32_t>(j) * static_cast<std::uint32_t>(grid.columns);
        visitor(CellRow{row + static_cast<std::uint32_t>(c0), row + static_cast<std::uint32_t>(i0),
                        row + static_cast<std::uint32_t>(i1), row + static_cast<std::uint32_t>(c1),
                        (c0 << grid.column_shift) - w.offset_x, low, cut_y});
      }
    });
  }

  /// Cells of a row that are read as one run: from `from` to before `to`.
  struct Piece {
    std::uint32_t from, to;
    int x, y;
    bool cut_x, cut_y;
  };

  /// Visits the pieces of a block's grid that a footprint meets.
  template <class Visitor>
  GLINT_HD void forEachPiece(const TexelCover& cover, const BinBlock& block, CellRows& kept, Visitor&& visitor) const {
    const CellGrid shape = cellGrid(code_, block.cell_bits);
    const auto visit = [&](const CellRow& row) { splitRow(row, shape, visitor); };
    const CellRows::Grid& grid = cellRows(cover, block, kept);
    if (grid.count > CellRows::kMost)
      forEachCellRow(cover, shape, visit);
    else
      for (int k = 0; k < grid.count; ++k) visit(grid.rows[k]);
  }

  template <class Visitor>
  static GLINT_HD void splitRow(const CellRow& row, const CellGrid& grid, Visitor& visitor) {
    const auto each = [&](std::uint32_t from, std::uint32_t to) {
      for (std::uint32_t c = from; c < to; ++c)
        visitor(Piece{c, c + 1, row.x + (static_cast<int>(c - row.first) << grid.column_shift), row.y, true, row.cut_y});
    };
    each(row.first, row.whole);
    if (row.whole < row.whole_end) visitor(Piece{row.whole, row.whole_end, 0, row.y, false, row.cut_y});
    each(row.whole_end, row.end);
  }

  template <class Visitor>
  GLINT_HD void visitPiece(std::uint32_t first_cell, const Piece& piece, Visitor& visitor) const {
    const std::uint64_t begin = map_.cell_starts[std::uint64_t{first_cell} + piece.from];
    const std::uint64_t end = map_.cell_starts[std::uint64_t{first_cell} + piece.to];
    if (begin == end) return;
    if (piece.cut_x || piece.cut_y)
      visitor.partial(TexelRun{begin, end, piece.x, piece.y, piece.cut_x, piece.cut_y});
    else
      visitor.whole(begin, end);
  }

  /// Rounds down; numbers outside [-1, limit + 1] are clamped to it first.
  static GLINT_HD int floorTo(double x, int limit) { return static_cast<int>(std::floor(std::clamp(x, -1.0, limit + 1.0))); }

  BinMap map_;
  TexelCode code_;
  int tiles_;
};

}  // namespace glint
