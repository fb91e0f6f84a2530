#pragma once

#include <algorithm>
#include <cstdint>

#include "glint/query/detail/bin_map/bin_blocks.h"
#include "glint/query/detail/bin_map/run_reader.h"

namespace glint {

/// A block whose texels are counted, or whose lobes are added up.
struct LobeBlock {
  BinBlock block;
  TexelCode code;
  SubbinLobe lobe;  ///< the half vector, from the block
  bool count, add;  ///< whether areas, and whether lobes are asked
};

/// Adds up, for each of some blocks, the areas of its texels in the footprint, and the lobes of its texels at a half vector, each times its
/// area (BinBlocks::forEachRun).
class LobeSums : public RunReader<LobeSums, LobeBlock> {
 public:
  static constexpr int kMostBlocks = 31;

  /// @param texels  the lists of all blocks, one after the other
  /// @param blocks  at most kMostBlocks
  GLINT_HD LobeSums(const std::uint32_t* texels, const TexelCover& cover, const LobeBlock* blocks)
      : RunReader(texels, cover), blocks_(blocks) {}
  GLINT_HD void whole(std::uint64_t begin, std::uint64_t end) {
    if (selected().count) areas_[indexOf(selected())] += static_cast<double>(end - begin);
    if (selected().add) partial({begin, end, 0, 0, false, false});
  }
  /// Completes the sums: call once, after the last run.
  GLINT_HD void finish() { flush(); }

  GLINT_HD double area(int block) const { return areas_[block]; }
  GLINT_HD double lobes(int block) const { return lobes_[block]; }

 private:
  friend RunReader;

  GLINT_HD std::ptrdiff_t indexOf(const LobeBlock& block) const { return &block - blocks_; }

  template <class Texels, unsigned kCut>
  GLINT_HD void add(const Item& item, const typename Texels::Parts& parts) {
    constexpr std::uint64_t kMostSummed = 512;  // texels that are summed in float; more lose digits
    if (isTurned<kCut>()) {
      addTurned(item);
      return;
    }
    const SubbinFields fields(item.block->code);
    double area = 0, lobes = 0;
    for (std::uint64_t k = 0; k < sizeOf(item); k += kMostSummed) {
      const std::uint32_t* texels = texelsOf(item) + k;
      const auto count = static_cast<int>(std::min(sizeOf(item) - k, kMostSummed));
      // `whole` has counted runs that are not cut.
      if (kCut != 0 && item.block->count) area += double{Texels::template sum<kCut>(texels, count, parts)};
      if (item.block->add) lobes += double{Texels::template lobes<kCut>(texels, count, parts, fields, item.block->lobe)};
    }
    areas_[indexOf(*item.block)] += area;
    lobes_[indexOf(*item.block)] += lobes;
  }

  GLINT_DEVICE_CALL GLINT_HD void addTurned(const Item& item) {
    const SubbinFields fields(item.block->code);
    double areas = 0, lobes = 0;
    forEachTurned(item, [&](std::uint32_t texel, auto area) {
      const float lobe = item.block->add ? item.block->lobe.at(Lanes1{fields.x(texel)}, Lanes1{fields.y(texel)}).v : 0;
      if (!item.block->count && !(lobe > 0)) return;
      const double covered = area();
      areas += covered, lobes += double{lobe} * covered;
    });
    areas_[indexOf(*item.block)] += areas;
    lobes_[indexOf(*item.block)] += lobes;
  }

  const LobeBlock* blocks_;
  double areas_[kMostBlocks] = {}, lobes_[kMostBlocks] = {};
};

}  // namespace glint
