#pragma once

#include <algorithm>
#include <cstdint>
#include <type_traits>

#include "glint/query/detail/bin_map/bin_blocks.h"
#include "glint/query/detail/bin_map/slot_sums.h"
#include "glint/query/detail/bin_map/texel_filter.h"

namespace glint {

/// Weights of the bins around a half vector: the share of the footprint whose normals are in the bin (Atanasov 2021, section
/// 5.2).
struct BinWeights {
  static constexpr int kMost = 21;  ///< 5 x 5 without the corners

  int count = 0;
  std::uint32_t bins[kMost];  ///< row * bins_per_axis + column; only bins that some texel of the footprint is in
  double weights[kMost];      ///< more than 0, at most 1 to rounding
};

/// The bins around a half vector: 5 x 5 slots, row by row.
struct BinWindow {
  static constexpr int kReach = 2, kSide = 2 * kReach + 1, kSlots = kSide * kSide;
  static_assert(kSide == SlotFields::kSide && kSlots == SlotSums::kSlots);

  GLINT_HD BinWindow(int centre_column, int centre_row, int bins_per_axis)
      : column(centre_column - kReach), row(centre_row - kReach), across(bins_per_axis) {
    bins = {std::max(column, 0), std::min(column + kSide, across), std::max(row, 0), std::min(row + kSide, across)};
  }
  static GLINT_HD bool isCorner(int slot) {
    return slot == 0 || slot == kSide - 1 || slot == kSlots - kSide || slot == kSlots - 1;
  }
  GLINT_HD int slotOf(const BinBlock& block) const { return (block.row - row) * kSide + block.column - column; }
  GLINT_HD bool isCorner(const BinBlock& block) const { return block.side_bits == 0 && isCorner(slotOf(block)); }
  GLINT_HD BinWeights weights(const double* areas, double scale) const {
    BinWeights result;
    for (int dy = 0; dy < kSide; ++dy) {
      if (row + dy < bins.row_begin || row + dy >= bins.row_end) continue;
      const int reach = dy == 0 || dy == kSide - 1 ? kReach - 1 : kReach;
      for (int dx = kReach - reach; dx <= kReach + reach; ++dx) {
        const double area = areas[dy * kSide + dx];
        result.bins[result.count] = static_cast<std::uint32_t>((row + dy) * across + column + dx);
        result.weights[result.count] = scale * area;
        const bool exists = column + dx >= bins.column_begin && column + dx < bins.column_end;
        result.count += exists && area > 0 ? 1 : 0;
      }
    }
    return result;
  }

  int column, row;  ///< of slot 0; bins outside the square of half vectors are left out, since no valid file has texels there
  int across;
  BinRect bins;
};

/// The blocks of a window.
struct WindowBlocks {
  int count = 0;
  BinBlock blocks[BinWindow::kSlots];
};

/// A block and its position in a window.
struct WindowBlock {
  WindowBlock() = default;
  GLINT_HD WindowBlock(const BinBlock& b, const TexelCode& c, const BinWindow& window)
      : block(b), code(c), slot(window.slotOf(b)) {
    const int shift = code.column_bits + code.row_bits + code.subbin_bits - block.side_bits;
    fields = {shift, std::min(shift + code.subbin_bits, 31), (1u << block.side_bits) - 1,
              static_cast<std::uint32_t>(b.column - window.column), static_cast<std::uint32_t>(b.row - window.row)};
  }
  GLINT_HD bool isBin() const { return block.side_bits == 0; }

  BinBlock block;
  TexelCode code;
  int slot;  ///< slot of the block's first bin; may be outside the window
  SlotFields fields;
};

/// Covered parts of the columns and rows of a footprint's bounding box, for footprints with sides along the axes: less than 1
/// for the first and the last column and row.
struct BoxSides {
  GLINT_HD explicit BoxSides(const TexelCover& cover)
      : last_x(cover.columns() - 1),
        last_y(cover.rows() - 1),
        left(cover.firstColumn()),
        right(cover.lastColumn()),
        lower(cover.firstRow()),
        upper(cover.lastRow()) {}
  GLINT_HD double column(int x) const { return x == 0 ? left : x == last_x ? right : 1; }
  GLINT_HD double row(int y) const { return y == 0 ? lower : y == last_y ? upper : 1; }

  GLINT_HD RangeEnds columns() const { return {static_cast<float>(left), static_cast<float>(right)}; }
  GLINT_HD RangeEnds rows() const { return {static_cast<float>(lower), static_cast<float>(upper)}; }

  /// Covered area of a texel of a run.
  /// @tparam kCut  fields along which the run may be cut (withCut)
  template <unsigned kCut>
  GLINT_HD double texelArea(const TexelCover& cover, const TexelRun& run, const TexelCode& code, std::uint32_t texel) const {
    const int x = static_cast<int>(code.column(texel)) + run.x, y = static_cast<int>(code.row(texel)) + run.y;
    if (kCut == 0) return 1;
    if (!cover.aligned()) return cover.texel(x, y);
    return ((kCut & TexelFilter::kColumn) != 0 ? column(x) : 1) * ((kCut & TexelFilter::kRow) != 0 ? row(y) : 1);
  }

  int last_x, last_y;
  double left, right, lower, upper;
};

/// Ranges of the column and row fields of a run that are inside the footprint's bounding box.
inline GLINT_HD IndexRange columnsIn(const TexelCover& cover, const TexelRun& run) {
  return {-run.x, cover.columns() - 1 - run.x};
}
inline GLINT_HD IndexRange rowsIn(const TexelCover& cover, const TexelRun& run) { return {-run.y, cover.rows() - 1 - run.y}; }

/// Calls visitor(c), where c() is a constant: the fields of TexelFilter along which the footprint may cut the run.
template <class Visitor>
GLINT_HD void withCut(const TexelRun& run, Visitor&& visitor) {
  constexpr unsigned kColumn = TexelFilter::kColumn, kRow = TexelFilter::kRow;
  if (run.cut_x && run.cut_y)
    visitor(std::integral_constant<unsigned, kColumn | kRow>());
  else if (run.cut_x)
    visitor(std::integral_constant<unsigned, kColumn>());
  else if (run.cut_y)
    visitor(std::integral_constant<unsigned, kRow>());
  else
    visitor(std::integral_constant<unsigned, 0>());
}

/// Adds up the covered areas of runs (BinBlocks::forEachRun) by bin. Prefetches up to kMost runs before it reads them, so that
/// their cache misses overlap.
class WindowSum {
 public:
  /// @param texels  the lists of all blocks, one after the other
  /// @param areas   sums by slot of the window; results are added
  GLINT_HD WindowSum(const std::uint32_t* texels, const TexelCover& cover, double* areas)
      : cover_(cover), sides_(cover), texels_(texels), areas_(areas) {}
  /// Sets the block of the next runs. `block` must stay alive until `finish`.
  GLINT_HD void select(const WindowBlock& block) { block_ = &block; }
  GLINT_HD void whole(std::uint64_t begin, std::uint64_t end) {
    if (block_->isBin())
      sums_.add(block_->slot, static_cast<double>(end - begin));
    else
      partial({begin, end, 0, 0, false, false});
  }
  GLINT_HD void partial(const TexelRun& run) {
    constexpr std::uint64_t kLine = 16, kAhead = 16 * kLine;  // texels
    for (std::uint64_t k = run.begin; k < std::min(run.end, run.begin + kAhead); k += kLine) prefetch(texels_ + k);
    prefetch(texels_ + run.end - 1);
    items_[count_++] = {run, block_};
    if (count_ == kMost) flush();
  }
  /// Completes the sums: call once, after the last run.
  GLINT_HD void finish() {
    flush();
    sums_.addTo(areas_);
  }

 private:
  static constexpr int kMost = 32;
  struct Item {
    TexelRun run;
    const WindowBlock* block;
  };

  GLINT_DEVICE_CALL GLINT_HD void flush() {
#ifdef GLINT_AVX2
    hasAvx2() ? flushAvx2() : flushBy<SingleTexels>();
#else
    flushBy<SingleTexels>();
#endif
    count_ = 0;
  }
#ifdef GLINT_AVX2
  GLINT_AVX2 GLINT_FLATTEN void flushAvx2() { flushBy<Avx2Texels>(); }
#endif

  template <class Texels>
  GLINT_HD void flushBy() {
    for (int k = 0; k < count_;) {
      const Item& first = items_[k];
      const typename Texels::Parts parts(partsOf(first));
      withCut(first.run, [&](auto cut) {
        do add<Texels, cut()>(items_[k], parts);
        while (++k < count_ && countAlike(first, items_[k]));
      });
    }
  }

  template <class Texels, unsigned kCut>
  GLINT_HD void add(const Item& item, const typename Texels::Parts& parts) {
    const std::uint32_t* texels = texels_ + item.run.begin;
    const std::uint64_t count = item.run.end - item.run.begin;
    if (kCut != 0 && !cover_.aligned())
      addTurned(item);
    else if (item.block->isBin())
      sums_.addBin<Texels, kCut>(texels, count, parts, item.block->slot);
    else
      sums_.addBins<Texels, kCut>(texels, count, parts, item.block->fields);
  }

  /// Whether equal codes of two runs have equal weights, so that one TexelParts serves both.
  static GLINT_HD bool countAlike(const Item& a, const Item& b) {
    return a.run.x == b.run.x && a.run.y == b.run.y && a.run.cut_x == b.run.cut_x && a.run.cut_y == b.run.cut_y &&
           a.block->code.column_bits == b.block->code.column_bits && a.block->code.row_bits == b.block->code.row_bits;
  }

  GLINT_HD TexelParts partsOf(const Item& item) const {
    const TexelCode& code = item.block->code;
    return {{0, code.column_bits, columnsIn(cover_, item.run), sides_.columns()},
            {code.column_bits, code.row_bits, rowsIn(cover_, item.run), sides_.rows()}};
  }

  /// Adds a run where the sides of the footprint are not along the axes.
  GLINT_DEVICE_CALL GLINT_HD void addTurned(const Item& item) {
    constexpr unsigned kPosition = TexelFilter::kPosition;
    const TexelFilter near(item.block->code, columnsIn(cover_, item.run), rowsIn(cover_, item.run), {}, {});
    near.forEach<kPosition>(texels_ + item.run.begin, item.run.end - item.run.begin, [&](std::uint32_t texel) {
      const std::uint32_t slot = item.block->fields.slotOf(texel);
      if (slot == SlotFields::kNone) return;
      sums_.add(static_cast<int>(slot), sides_.texelArea<kPosition>(cover_, item.run, item.block->code, texel));
    });
  }

  const TexelCover& cover_;
  BoxSides sides_;
  const std::uint32_t* texels_;
  double* areas_;
  SlotSums sums_;
  const WindowBlock* block_ = nullptr;
  int count_ = 0;
  Item items_[kMost];
};

}  // namespace glint
