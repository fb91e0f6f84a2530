#pragma once

#include <algorithm>
#include <cstdint>
#include <type_traits>

#include "glint/query/bin_blocks.h"
#include "glint/query/texel_filter.h"

namespace glint {

/// Weights of the bins around a half vector: the share of a footprint whose normals are in each (Atanasov 2021, section 5.2).
struct BinWeights {
  static constexpr int kMost = 21;  ///< 5 x 5 without the corners

  int count = 0;
  std::uint32_t bins[kMost];  ///< row * bins_per_axis + column; only bins that some texel of the footprint is in
  double weights[kMost];      ///< more than 0, at most 1
};

/// The bins around a half vector: 5 x 5 slots, row by row.
struct BinWindow {
  static constexpr int kReach = 2, kSide = 2 * kReach + 1, kSlots = kSide * kSide;

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
      const int reach = dy == 0 || dy == kSide - 1 ? kReach - 1 : kReach;
      for (int dx = kReach - reach; dx <= kReach + reach; ++dx) {
        const double area = areas[dy * kSide + dx];
        result.bins[result.count] = static_cast<std::uint32_t>((row + dy) * across + column + dx);
        result.weights[result.count] = scale * area;
        result.count += area > 0 ? 1 : 0;
      }
    }
    return result;
  }

  int column, row;  ///< of the first bin; bins beyond the square have no texels
  int across;
  BinRect bins;
};

/// The blocks of a window.
struct WindowBlocks {
  int count = 0;
  BinBlock blocks[BinWindow::kSlots];
};

/// A block and where it lies in a window.
struct WindowBlock {
  WindowBlock() = default;
  GLINT_HD WindowBlock(const BinBlock& b, const TexelCode& c, const BinWindow& window)
      : block(b), code(c), slot(window.slotOf(b)), bin_shift(c.place_bits - b.side_bits) {
    columns = placesOf(window.bins.column_begin - b.column, window.bins.column_end - b.column);
    rows = placesOf(window.bins.row_begin - b.row, window.bins.row_end - b.row);
  }
  GLINT_HD IndexRange placesOf(int begin, int end) const {
    return {std::max(begin, 0) << bin_shift, (std::min(end, block.side()) << bin_shift) - 1};
  }
  GLINT_HD bool isBin() const { return block.side_bits == 0; }
  GLINT_HD int slotOf(std::uint32_t texel) const {
    const int dx = static_cast<int>(code.placeX(texel) >> bin_shift), dy = static_cast<int>(code.placeY(texel) >> bin_shift);
    return slot + dy * BinWindow::kSide + dx;
  }

  BinBlock block;
  TexelCode code;
  int slot = 0;  ///< of the first bin; may be outside
  int bin_shift = 0;
  IndexRange columns, rows;  ///< places in the window
};

/// What of its border texels a box along the axes covers.
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

  GLINT_HD TexelFilter::Ends columns() const { return {static_cast<float>(left), static_cast<float>(right)}; }
  GLINT_HD TexelFilter::Ends rows() const { return {static_cast<float>(lower), static_cast<float>(upper)}; }

  /// Covered area of a texel in the bounding box, of a run that is cut along kCut.
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

/// Calls visitor(c), where c() is the fields of TexelFilter along which a run is cut.
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

/// Adds up the areas of runs (BinBlocks::forEachRun) by bin. Several are asked for before they are read: the processor then
/// waits for all of them together.
class WindowSum {
 public:
  /// @param texels  of all lists
  /// @param areas  of the window's slots
  GLINT_HD WindowSum(const std::uint32_t* texels, const TexelCover& cover, double* areas)
      : cover_(cover), sides_(cover), texels_(texels), areas_(areas) {}
  /// The block that the next runs are of; kept until `finish`.
  GLINT_HD void select(const WindowBlock& block) { block_ = &block; }
  GLINT_HD void whole(std::uint64_t begin, std::uint64_t end) {
    if (block_->isBin())
      areas_[block_->slot] += static_cast<double>(end - begin);
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
  GLINT_HD void flush() {
    for (int k = 0; k < count_; ++k) add(items_[k]);
    count_ = 0;
  }
  /// To be called when all runs are in.
  GLINT_HD void finish() {
    flush();
    for (int k = 0; k < BinWindow::kSlots; ++k) areas_[k] += counts_[k];
  }

 private:
  static constexpr int kMost = 32;
  struct Item {
    TexelRun run;
    const WindowBlock* block;
  };

  GLINT_HD void add(const Item& item) {
    withCut(item.run, [&](auto cut) { addCut<cut()>(item); });
  }

  template <unsigned kCut>
  GLINT_HD void addCut(const Item& item) {
    if (!item.block->isBin())
      addShared<kCut>(item);
    else if (cover_.aligned())
      areas_[item.block->slot] += alignedArea<kCut>(item);
    else
      areas_[item.block->slot] += turnedArea(item);
  }

  /// Of texels in the footprint's bounding box and in the window.
  GLINT_HD TexelFilter filter(const Item& item) const {
    const TexelRun& run = item.run;
    return {item.block->code,
            {-run.x, cover_.columns() - 1 - run.x},
            {-run.y, cover_.rows() - 1 - run.y},
            item.block->columns,
            item.block->rows};
  }

  /// Calls visitor(first texel, count) for a run, at most TexelFilter::kMostAtOnce at a time.
  template <class Visitor>
  GLINT_HD void forEachPart(const Item& item, Visitor&& visitor) const {
    for (std::uint64_t k = item.run.begin; k < item.run.end; k += TexelFilter::kMostAtOnce)
      visitor(texels_ + k, static_cast<int>(std::min<std::uint64_t>(item.run.end - k, TexelFilter::kMostAtOnce)));
  }

  template <unsigned kCut>
  GLINT_HD double texelArea(const Item& item, std::uint32_t texel) const {
    return sides_.texelArea<kCut>(cover_, item.run, item.block->code, texel);
  }

  /// Texels of several bins.
  template <unsigned kCut>
  GLINT_HD void addShared(const Item& item) {
    const TexelFilter near = filter(item);
    forEachPart(item, [&](const std::uint32_t* texels, int count) {
      for (std::uint64_t bits = near.matches<kCut | TexelFilter::kPlace>(texels, count); bits != 0; bits &= bits - 1) {
        const std::uint32_t texel = texels[lowestBit(bits)];
        if constexpr (kCut == 0)
          ++counts_[item.block->slotOf(texel)];
        else
          areas_[item.block->slotOf(texel)] += texelArea<kCut>(item, texel);
      }
    });
  }

  /// Texels of one bin, for boxes along the axes.
  template <unsigned kCut>
  GLINT_HD double alignedArea(const Item& item) const {
    return filter(item).sum<kCut>(texels_ + item.run.begin, item.run.end - item.run.begin, sides_.columns(), sides_.rows());
  }

  GLINT_HD double turnedArea(const Item& item) const {
    const TexelFilter any = filter(item);
    double area = 0;
    forEachPart(item, [&](const std::uint32_t* texels, int count) {
      for (std::uint64_t bits = any.matches<TexelFilter::kPosition>(texels, count); bits != 0; bits &= bits - 1)
        area += texelArea<TexelFilter::kPosition>(item, texels[lowestBit(bits)]);
    });
    return area;
  }

  const TexelCover& cover_;
  BoxSides sides_;
  const std::uint32_t* texels_;
  double* areas_;
  std::uint32_t counts_[BinWindow::kSlots] = {};  ///< of texels that are covered completely
  const WindowBlock* block_ = nullptr;
  int count_ = 0;
  Item items_[kMost];
};

}  // namespace glint
