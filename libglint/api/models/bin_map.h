#pragma once

#include "glint/api/models/ndf_traits.h"
#include "glint/formats/number_text.h"
#include "glint/model/error.h"
#include "glint/query/bin_map_ndf.h"

namespace glint::api {

template <>
struct NdfTraits<BinMapNdf> {
  using Asset = BinMap;
  static constexpr std::string_view kKind = formats::kKindName<Asset>;

  static BinMapNdf open(const NdfSource<BinMap>& source) {
    return {source.asset, askedAlpha(source), source.options.estimator};
  }

  static NdfInfo info(const NdfSource<BinMap>& source) {
    NdfInfo info;
    info.width = source.asset.width;
    info.height = source.asset.height;
    info.resolution = kDefaultResolution;
    info.sigma_r = open(source).sigma();
    info.shapes = {.boxes = true};
    return info;
  }

  static MapSlopes slopes(const BinMap& map) { return map.slopes; }
  static constexpr bool kPacks = false;

 private:
  static float askedAlpha(const NdfSource<BinMap>& source) {
    const BinMap& map = source.asset;
    const float alpha = source.options.alpha;
    if (alpha == 0) return map.alpha_min;
    if (alpha >= map.alpha_min && alpha <= map.alpha_max) return alpha;
    throw Error(ErrorCode::usage, "query.alpha", source.path.string(), "",
                "was made for roughnesses of " + formats::numberText(map.alpha_min) + " to " +
                    formats::numberText(map.alpha_max) + ", not " + formats::numberText(alpha),
                "ask within the range, or make it with glint-binmap --alpha A:B");
  }
};

}  // namespace glint::api
