#pragma once

// What the models of pyramids and of compressed pyramids share.

#include <cmath>

#include "glint/api/models/ndf_traits.h"
#include "glint/model/ndf_pyramid.h"
#include "glint/query/anisotropic_ndf.h"
#include "glint/query/detail/pyramid/texel_blend.h"

namespace glint::api {

/// Makes a model of round footprints, and the one that asks it for any footprint.
template <class Round, class Asset>
AnisotropicNdf<Round> openLevels(const NdfSource<Asset>& source) {
  const Interpolation between = source.options.interpolation;
  const Pixels pixels = source.options.pixels;
  const Round round =
      source.normals != nullptr ? Round(source.asset, *source.normals, between, pixels) : Round(source.asset, between, pixels);
  return {round, source.options.footprint_parts};
}

/// Whether the normals of the map are given, or kept in the asset.
template <class Asset>
bool hasNormals(const NdfSource<Asset>& source) {
  return source.normals != nullptr || source.asset.near_normals.has_value();
}

/// @param has_normals  whether footprints below level 0 are answered from the texels
inline NdfInfo levelsInfo(const PyramidShape& shape, bool has_normals) {
  NdfInfo info;
  info.width = shape.width;
  info.height = shape.height;
  info.resolution = shape.resolution;
  info.sigma_r = shape.sigma_r;
  info.surface = shape.surface;
  info.boundary = shape.boundary;
  info.shapes = {.gaussians = true};
  info.level_count = shape.footprintLevels();
  info.finest_sigma_texels = finestSigma(shape);
  info.coarsest_sigma_texels = kFootprintPerStride * shape.levels[shape.footprintLevels() - 1].stride;
  info.smallest_sigma_texels = has_normals ? 0 : std::sqrt(smallestSeenVariance(shape));
  return info;
}

}  // namespace glint::api
