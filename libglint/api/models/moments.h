#pragma once

#include "glint/api/models/ndf_traits.h"
#include "glint/query/moments_ndf.h"

namespace glint::api {

template <>
struct NdfTraits<MomentsNdf> {
  using Asset = SlopeMoments;
  static constexpr std::string_view kKind = formats::kKindName<Asset>;

  static MomentsNdf open(const NdfSource<SlopeMoments>& source) {
    return MomentsNdf(source.asset, source.options.sigma_r, source.options.footprint_parts);
  }

  static NdfInfo info(const NdfSource<SlopeMoments>& source) {
    const SlopeMoments& moments = source.asset;
    NdfInfo info;
    info.width = moments.width;
    info.height = moments.height;
    info.resolution = kDefaultResolution;
    info.sigma_r = source.options.sigma_r;
    info.boundary = moments.boundary;
    info.shapes = {.gaussians = true};
    info.level_count = moments.level_count;
    info.finest_sigma_texels = open(source).smallestSigma();
    info.coarsest_sigma_texels = open(source).largestSigma();
    info.smallest_sigma_texels = info.finest_sigma_texels;
    return info;
  }

  static MapSlopes slopes(const SlopeMoments& moments) { return moments.slopes; }
  static constexpr bool kPacks = false;
};

}  // namespace glint::api
