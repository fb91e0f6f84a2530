#pragma once

#include "glint/api/models/levels.h"
#include "glint/api/models/ndf_traits.h"
#include "glint/query/wang_plane.h"
#include "glint/query/wang_reference.h"

namespace glint::api {

/// Planes of images of tiles.
template <class Images>
struct NdfTraits<WangPlane<Images>> {
  using Asset = typename Images::Asset;
  static constexpr std::string_view kKind = formats::kKindName<Asset>;

  static WangPlane<Images> open(const NdfSource<Asset>& source) {
    return WangPlane<Images>(source.asset, source.options.pixels, source.options.footprint_parts);
  }
  /// Width and height are those of a tile.
  static NdfInfo info(const NdfSource<Asset>& source) {
    NdfInfo info = levelsInfo(source.asset.images.shape, false);
    info.boundary = Boundary::wrap;  // a plane has no border
    return info;
  }
  static MapSlopes slopes(const Asset& asset) { return asset.images.shape.slopes; }
  static constexpr bool kPacks = false;
};

/// The tiles themselves.
template <>
struct NdfTraits<WangReference> {
  using Asset = WangTiles;
  static constexpr std::string_view kKind = formats::kKindName<Asset>;

  static WangReference open(const NdfSource<WangTiles>& source) {
    return WangReference(source.asset, source.options.sigma_r, source.options.surface);
  }
  static NdfInfo info(const NdfSource<WangTiles>& source) {
    NdfInfo info;
    info.width = info.height = source.asset.size;
    info.resolution = kDefaultResolution;
    info.sigma_r = source.options.sigma_r;
    info.surface = source.options.surface;
    info.shapes = {.gaussians = true, .boxes = true};
    return info;
  }
  static MapSlopes slopes(const WangTiles& tiles) { return tiles.slopes; }
  static constexpr bool kPacks = false;
};

}  // namespace glint::api
