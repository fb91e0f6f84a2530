#pragma once

#include "glint/api/models/ndf_traits.h"
#include "glint/model/slope_sums.h"
#include "glint/query/reference.h"

namespace glint::api {

template <>
struct NdfTraits<Reference> {
  using Asset = NormalMap;
  static constexpr std::string_view kKind = formats::kKindName<Asset>;

  static Reference open(const NdfSource<NormalMap>& source) {
    const NdfOptions& options = source.options;
    return {source.asset, options.sigma_r, options.surface, options.boundary, Reference::Search::pruned};
  }

  static NdfInfo info(const NdfSource<NormalMap>& source) {
    NdfInfo info;
    info.width = source.asset.width;
    info.height = source.asset.height;
    info.resolution = kDefaultResolution;
    info.sigma_r = source.options.sigma_r;
    info.surface = source.options.surface;
    info.boundary = source.options.boundary;
    info.shapes = {.gaussians = true, .boxes = true};
    return info;
  }

  /// Slopes that the map holds; where it holds none, sums over all texels.
  static MapSlopes slopes(const NormalMap& map) { return map.slopes ? *map.slopes : slopesOf(map); }

  static constexpr bool kPacks = true;
  static void pack(const NdfSource<NormalMap>& source, Packer& packer) {
    PackedHeader& header = packer.header();
    header.kind = PackedKind::normals;
    header.sigma_r = source.options.sigma_r;
    header.surface = static_cast<std::uint32_t>(source.options.surface);
    header.boundary = static_cast<std::uint32_t>(source.options.boundary);
    packer.addNormals(source.asset);
  }
};

}  // namespace glint::api
