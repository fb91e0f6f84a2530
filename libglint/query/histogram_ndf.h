#pragma once

#include <cmath>

#include "glint/model/histogram_sat.h"
#include "glint/query/footprint_weights.h"
#include "glint/query/ndf_model.h"

namespace glint {

/// The NDF from accumulated histograms of normals (Gamboa 2018, section 4.1). The plane is periodic, texels are facets.
/// Thread-safe, allocates nothing; the arrays must outlive it.
class HistogramNdf {
 public:
  GLINT_HD explicit HistogramNdf(const HistogramSat& sat) : sat_(sat) {}

  const HistogramSat& sat() const { return sat_; }
  /// Bins that occur in the map.
  int binCount() const { return sat_.bin_count; }

  /// Mean normal of the texels of a bin over the whole map: the direction that stands for the bin.
  GLINT_HD Vec2 binNormal(int bin) const { return sat_.bin_normals.data()[bin]; }

  /// Whole histogram of a footprint: visitor(int bin, float weight) for every bin with weight > 0, in increasing order, 0 <= bin <
  /// binCount(). Weights are shares of the footprint and sum to 1.
  template <class Visitor>
  GLINT_HD void forEachBin(const Footprint& p, Visitor&& visitor) const {
    double counts[HistogramSat::kMaxBins];
    std::fill(counts, counts + sat_.bin_count, 0.0);
    const FootprintWeights weights(p, sat_.width, sat_.height);
    double total = 0;
    for (int j = weights.row_begin; j < weights.row_end; ++j) {
      for (int i = weights.column_begin; i < weights.column_end; ++i) {
        const double w = weights.texel(i, j);
        counts[sat_.texels.data()[sat_.texelIndex(wrap(i, sat_.width), wrap(j, sat_.height))]] += w;
        total += w;
      }
    }
    for (int bin = 0; bin < sat_.bin_count; ++bin)
      if (counts[bin] > 0) visitor(bin, static_cast<float>(counts[bin] / total));
  }

 private:
  static GLINT_HD int wrap(int i, int n) { return (i % n + n) % n; }
  HistogramSat sat_;
};

}  // namespace glint
