#pragma once

#include <algorithm>
#include <cstddef>

#include "glint/bake/displace/effective_brdf.h"

namespace glint::bake {

/// The facets of one patch as a list, from which samples are drawn evenly.
class PatchFacets {
 public:
  PatchFacets(const PatchGrid& grid, int patch, std::size_t wanted)
      : width_(grid.width()), column_(grid.firstColumn(patch % grid.columns)), row_(grid.firstRow(patch / grid.columns)) {
    columns_ = static_cast<std::size_t>(grid.firstColumn(patch % grid.columns + 1) - column_);
    facets_ = 2 * columns_ * static_cast<std::size_t>(grid.firstRow(patch / grid.columns + 1) - row_);
    repeats_ = std::max<std::size_t>(1, wanted / facets_);
    samples_ = wanted < facets_ ? std::max<std::size_t>(wanted, 1) : facets_ * repeats_;
  }
  /// Number of samples: about `wanted`, but the same number of each facet where there are enough for all.
  std::size_t samples() const { return samples_; }
  /// Facet of sample s. Where there are fewer samples than facets, the list is cut into as many equal parts as there are
  /// samples, and `random`, in (0, 1), chooses a facet in part s.
  std::size_t facet(std::size_t s, float random) const {
    const std::size_t k =
        samples_ >= facets_
            ? s / repeats_
            : std::min(facets_ - 1, static_cast<std::size_t>((static_cast<double>(s) + random) * static_cast<double>(facets_) /
                                                             static_cast<double>(samples_)));
    const std::size_t cell = k / 2;
    return 2 * ((static_cast<std::size_t>(row_) + cell / columns_) * static_cast<std::size_t>(width_) +
                static_cast<std::size_t>(column_) + cell % columns_) +
           k % 2;
  }

 private:
  int width_, column_, row_;
  std::size_t columns_ = 0, facets_ = 0, repeats_ = 1, samples_ = 0;
};

}  // namespace glint::bake
