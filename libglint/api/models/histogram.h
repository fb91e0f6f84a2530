#pragma once

#include "glint/api/models/ndf_traits.h"
#include "glint/query/histogram_ndf.h"

namespace glint::api {

template <>
struct NdfTraits<HistogramNdf> {
  using Asset = HistogramSat;
  static constexpr std::string_view kKind = formats::kKindName<Asset>;

  static HistogramNdf open(const NdfSource<HistogramSat>& source) {
    const NdfOptions& options = source.options;
    return HistogramNdf(source.asset, options.gaussian_boxes, options.slant_tolerance, options.histogram_bins, options.sigma_r);
  }

  static NdfInfo info(const NdfSource<HistogramSat>& source) {
    NdfInfo info;
    info.width = source.asset.width;
    info.height = source.asset.height;
    info.resolution = kDefaultResolution;
    if (source.options.histogram_bins == HistogramBins::lobes) info.sigma_r = source.options.sigma_r;
    info.shapes = {.boxes = true};
    return info;
  }

  static MapSlopes slopes(const HistogramSat& sat) { return sat.slopes; }
  static constexpr bool kPacks = false;
};

}  // namespace glint::api
