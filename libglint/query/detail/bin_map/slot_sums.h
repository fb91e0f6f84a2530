#pragma once

#include <algorithm>
#include <cstdint>

#include "glint/query/detail/bin_map/avx2_texels.h"

namespace glint {

/// Adds up the weights of texels by slot of a window. `Texels` is SingleTexels or Avx2Texels; both have the same results.
class SlotSums {
 public:
  static constexpr int kSlots = SlotFields::kNone;

  GLINT_HD void add(int slot, double amount) { sums_[0][slot] += amount; }

  /// Adds a list whose texels are all in one bin.
  template <class Texels, unsigned kCut>
  GLINT_HD void addBin(const std::uint32_t* texels, std::uint64_t count, const typename Texels::Parts& parts, int slot) {
    constexpr std::uint64_t kMostSummed = 256;  // texels that are summed in float; more lose digits
    double total = 0;
    for (std::uint64_t k = 0; k < count; k += kMostSummed)
      total += double{Texels::template sum<kCut>(texels + k, static_cast<int>(std::min(count - k, kMostSummed)), parts)};
    add(slot, total);
  }

  /// Adds a list whose texels are in several bins.
  template <class Texels, unsigned kCut>
  GLINT_HD void addBins(const std::uint32_t* texels, std::uint64_t count, const typename Texels::Parts& parts,
                        const SlotFields& fields) {
    constexpr std::uint64_t kMost = FoundTexels::kMost;
    for (std::uint64_t k = 0; k < count; k += kMost) {
      const auto some = static_cast<int>(std::min(count - k, kMost));
      if (found_.count + some > FoundTexels::kMost) addFound();
      Texels::template find<kCut>(texels + k, some, parts, fields, found_);
    }
  }

  /// Adds the sums to `areas`: call once, at the end.
  GLINT_HD void addTo(double* areas) {
    addFound();
    for (int k = 0; k < kSlots; ++k) areas[k] += (sums_[0][k] + sums_[2][k]) + (sums_[1][k] + sums_[3][k]);
  }

 private:
  GLINT_HD void addFound() {
    int k = 0;
    for (; k + 4 <= found_.count; k += 4)
      for (int j = 0; j < 4; ++j) sums_[j][found_.slots[k + j]] += double{found_.parts[k + j]};
    for (; k < found_.count; ++k) sums_[0][found_.slots[k]] += double{found_.parts[k]};
    found_.count = 0;
  }

  double sums_[4][kSlots] = {};  ///< four rows, so that an addition need not wait for the previous addition to its slot
  FoundTexels found_;
};

}  // namespace glint
