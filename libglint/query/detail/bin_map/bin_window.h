#pragma once

#include <algorithm>
#include <cstdint>

#include "glint/query/detail/bin_map/bin_blocks.h"
#include "glint/query/detail/bin_map/run_reader.h"
#include "glint/query/detail/bin_map/slot_sums.h"

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

/// Adds up the covered areas of runs by bin.
class WindowSum : public RunReader<WindowSum, WindowBlock> {
 public:
  /// @param texels  the lists of all blocks, one after the other
  /// @param areas   sums by slot of the window; results are added
  GLINT_HD WindowSum(const std::uint32_t* texels, const TexelCover& cover, double* areas)
      : RunReader(texels, cover), areas_(areas) {}
  GLINT_HD void whole(std::uint64_t begin, std::uint64_t end) {
    if (selected().isBin())
      sums_.add(selected().slot, static_cast<double>(end - begin));
    else
      partial({begin, end, 0, 0, false, false});
  }
  /// Completes the sums: call once, after the last run.
  GLINT_HD void finish() {
    flush();
    sums_.addTo(areas_);
  }

 private:
  friend RunReader;

  template <class Texels, unsigned kCut>
  GLINT_HD void add(const Item& item, const typename Texels::Parts& parts) {
    if (isTurned<kCut>())
      addTurned(item);
    else if (item.block->isBin())
      sums_.addBin<Texels, kCut>(texelsOf(item), sizeOf(item), parts, item.block->slot);
    else
      sums_.addBins<Texels, kCut>(texelsOf(item), sizeOf(item), parts, item.block->fields);
  }

  GLINT_DEVICE_CALL GLINT_HD void addTurned(const Item& item) {
    forEachTurned(item, [&](std::uint32_t texel, auto area) {
      const std::uint32_t slot = item.block->fields.slotOf(texel);
      if (slot != SlotFields::kNone) sums_.add(static_cast<int>(slot), area());
    });
  }

  double* areas_;
  SlotSums sums_;
};

}  // namespace glint
