#pragma once

#include "glint/api/models/ndf_traits.h"
#include "glint/query/histogram_ndf.h"

namespace glint::api {

template <>
struct NdfTraits<HistogramNdf> {
  using Asset = HistogramSat;
  static constexpr std::string_view kKind = formats::kKindName<Asset>;

  static HistogramNdf open(const NdfSource<HistogramSat>& source) {
    return HistogramNdf(source.asset, source.options.gaussian_boxes, source.options.slant_tolerance);
  }

  static NdfInfo info(const NdfSource<HistogramSat>& source) {
    NdfInfo info;
    info.width = source.asset.width;
    info.height = source.asset.height;
    info.resolution = kDefaultResolution;
    info.shapes = {.boxes = true};
    return info;
  }

  static MapSlopes slopes(const HistogramSat& sat) { return sat.slopes; }
  static constexpr bool kPacks = false;
};

}  // namespace glint::api
