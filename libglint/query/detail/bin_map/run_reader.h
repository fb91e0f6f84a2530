#pragma once

#include <algorithm>
#include <cstdint>
#include <type_traits>

#include "glint/query/detail/bin_map/avx2_texels.h"
#include "glint/query/detail/bin_map/bin_blocks.h"
#include "glint/query/detail/bin_map/texel_filter.h"

namespace glint {

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

/// Reads the runs of several blocks (BinBlocks::forEachRun) eight texels at a time where the processor has AVX2. Prefetches up to kMost runs
/// before it reads them, so that their cache misses overlap.
/// @tparam Reader  the class that derives from this one: its add<Texels, kCut>(item, parts) is called for each run, where Texels is
///                 SingleTexels or Avx2Texels and kCut the fields along which the footprint may cut the run
/// @tparam Block   has a BinBlock `block` and its TexelCode `code`
template <class Reader, class Block>
class RunReader {
 public:
  /// Sets the block of the next runs. `block` must stay alive until `flush`.
  GLINT_HD void select(const Block& block) { block_ = &block; }
  GLINT_HD void partial(const TexelRun& run) {
    constexpr std::uint64_t kLine = 16, kAhead = 16 * kLine;  // texels
    for (std::uint64_t k = run.begin; k < std::min(run.end, run.begin + kAhead); k += kLine) prefetch(texels_ + k);
    prefetch(texels_ + run.end - 1);
    items_[count_++] = {run, block_};
    if (count_ == kMost) flush();
  }

 protected:
  static constexpr int kMost = 32;
  struct Item {
    TexelRun run;
    const Block* block;
  };

  /// @param texels  the lists of all blocks, one after the other
  GLINT_HD RunReader(const std::uint32_t* texels, const TexelCover& cover) : cover_(cover), sides_(cover), texels_(texels) {}

  GLINT_HD const Block& selected() const { return *block_; }
  GLINT_HD const std::uint32_t* texelsOf(const Item& item) const { return texels_ + item.run.begin; }
  static GLINT_HD std::uint64_t sizeOf(const Item& item) { return item.run.end - item.run.begin; }
  /// Whether the covered areas of a run do not follow from its columns and rows alone.
  template <unsigned kCut>
  GLINT_HD bool isTurned() const {
    return kCut != 0 && !cover_.aligned();
  }

  /// Calls visitor(texel, area) for the texels of a run where the sides of the footprint are not along the axes.
  template <class Visitor>
  GLINT_HD void forEachTurned(const Item& item, Visitor&& visitor) const {
    constexpr unsigned kPosition = TexelFilter::kPosition;
    const TexelFilter near(item.block->code, columnsIn(cover_, item.run), rowsIn(cover_, item.run), {}, {});
    near.forEach<kPosition>(texelsOf(item), sizeOf(item), [&](std::uint32_t texel) {
      visitor(texel, [&] { return sides_.texelArea<kPosition>(cover_, item.run, item.block->code, texel); });
    });
  }

  /// Reads the runs that are waiting: call once after the last run.
  GLINT_DEVICE_CALL GLINT_HD void flush() {
#ifdef GLINT_AVX2
    hasAvx2() ? flushAvx2() : flushBy<SingleTexels>();
#else
    flushBy<SingleTexels>();
#endif
    count_ = 0;
  }

 private:
#ifdef GLINT_AVX2
  GLINT_AVX2 GLINT_FLATTEN void flushAvx2() { flushBy<Avx2Texels>(); }
#endif

  template <class Texels>
  GLINT_HD void flushBy() {
    for (int k = 0; k < count_;) {
      const Item& first = items_[k];
      const typename Texels::Parts parts(partsOf(first));
      withCut(first.run, [&](auto cut) {
        do static_cast<Reader*>(this)->template add<Texels, cut()>(items_[k], parts);
        while (++k < count_ && countAlike(first, items_[k]));
      });
    }
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

  const TexelCover& cover_;
  BoxSides sides_;
  const std::uint32_t* texels_;
  const Block* block_ = nullptr;
  int count_ = 0;
  Item items_[kMost];
};

}  // namespace glint
