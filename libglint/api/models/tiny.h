#pragma once

#include "glint/api/models/ndf_traits.h"
#include "glint/query/tiny_example_ndf.h"

namespace glint::api {

template <>
struct NdfTraits<TinyExampleNdf> {
  using Asset = TinyExample;
  static constexpr std::string_view kKind = formats::kKindName<Asset>;

  static TinyExampleNdf open(const NdfSource<TinyExample>& source) { return TinyExampleNdf(source.asset); }

  static NdfInfo info(const NdfSource<TinyExample>& source) {
    const PyramidShape& shape = source.asset.images.shape;
    NdfInfo info;
    info.width = shape.width;
    info.height = shape.height;
    info.resolution = shape.resolution;
    info.sigma_r = shape.sigma_r;
    info.surface = shape.surface;
    info.shapes = {.gaussians = true};
    return info;
  }

  static MapSlopes slopes(const TinyExample& example) { return example.images.shape.slopes; }
  static constexpr bool kPacks = false;
};

}  // namespace glint::api
