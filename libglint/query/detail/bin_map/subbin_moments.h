#pragma once

#include <algorithm>
#include <cstdint>

#include "glint/query/detail/bin_map/avx2_texels.h"
#include "glint/query/detail/bin_map/bin_blocks.h"
#include "glint/query/detail/bin_map/bin_window.h"

namespace glint {

/// Adds up SubbinMoments over the runs of one block (BinBlocks::forEachRun).
///
/// Whole runs that follow one another in the list are joined. Where they make up the whole list, the stored sums of the block
/// are used and no texel is read.
class SubbinMomentSum {
 public:
  /// @param texels  the lists of all blocks, one after the other
  /// @param all     moments of all texels of the block
  GLINT_HD SubbinMomentSum(const std::uint32_t* texels, const TexelCover& cover, const TexelCode& code, std::uint64_t begin,
                           std::uint64_t end, const SubbinMoments& all)
      : cover_(cover), sides_(cover), texels_(texels), code_(code), fields_(code), begin_(begin), end_(end), all_(all) {}

  GLINT_HD void whole(std::uint64_t begin, std::uint64_t end) {
    if (begin != whole_end_) {
      flush();
      whole_begin_ = begin;
    }
    whole_end_ = end;
  }
  GLINT_DEVICE_CALL GLINT_HD void partial(const TexelRun& run) {
    withCut(run, [&](auto cut) {
      if (cut() != 0 && !cover_.aligned())
        addTurned(run);
      else
        add<cut()>(run);
    });
  }
  /// Completes the sums: call once, after the last run.
  GLINT_HD const SubbinMoments& finish() {
    flush();
    return sums_;
  }

 private:
  GLINT_HD void flush() {
    if (whole_begin_ == begin_ && whole_end_ == end_)
      sums_.add(1, all_);
    else if (whole_begin_ < whole_end_)
      add<0>({whole_begin_, whole_end_, 0, 0, false, false});
    whole_begin_ = whole_end_ = 0;
  }

  template <unsigned kCut>
  GLINT_HD void add(const TexelRun& run) {
    const TexelParts parts = {{0, code_.column_bits, columnsIn(cover_, run), sides_.columns()},
                              {code_.column_bits, code_.row_bits, rowsIn(cover_, run), sides_.rows()}};
#ifdef GLINT_AVX2
    if (hasAvx2()) return addAvx2<kCut>(run, parts);
#endif
    addBy<SingleTexels, kCut>(run, parts);
  }
#ifdef GLINT_AVX2
  template <unsigned kCut>
  GLINT_AVX2 GLINT_FLATTEN void addAvx2(const TexelRun& run, const TexelParts& parts) {
    addBy<Avx2Texels, kCut>(run, parts);
  }
#endif
  template <class Texels, unsigned kCut>
  GLINT_HD void addBy(const TexelRun& run, const TexelParts& of_run) {
    constexpr std::uint64_t kMostSummed = 512;  // texels that are summed in float; more lose digits
    const typename Texels::Parts parts(of_run);
    for (std::uint64_t k = run.begin; k < run.end; k += kMostSummed)
      sums_.add(
          1, Texels::template moments<kCut>(texels_ + k, static_cast<int>(std::min(run.end - k, kMostSummed)), parts, fields_));
  }

  /// Adds a run where the sides of the footprint are not along the axes.
  GLINT_DEVICE_CALL GLINT_HD void addTurned(const TexelRun& run) {
    constexpr unsigned kPosition = TexelFilter::kPosition;
    const TexelFilter near(code_, columnsIn(cover_, run), rowsIn(cover_, run), {}, {});
    near.forEach<kPosition>(texels_ + run.begin, run.end - run.begin, [&](std::uint32_t texel) {
      const double x = fields_.x(texel), y = fields_.y(texel);
      sums_.add(sides_.texelArea<kPosition>(cover_, run, code_, texel), {1, x, y, x * x, x * y, y * y});
    });
  }

  const TexelCover& cover_;
  BoxSides sides_;
  const std::uint32_t* texels_;
  TexelCode code_;
  SubbinFields fields_;
  std::uint64_t begin_, end_;  ///< the list of the block
  SubbinMoments all_, sums_;
  std::uint64_t whole_begin_ = 0, whole_end_ = 0;  ///< whole runs, joined, that are not added yet
};

}  // namespace glint
