#pragma once

// What the models of pyramids and of compressed pyramids share.

#include "glint/api/models/ndf_traits.h"
#include "glint/model/ndf_pyramid.h"
#include "glint/query/anisotropic_ndf.h"

namespace glint::api {

/// Makes a model of round footprints, and the one that asks it for any footprint.
template <class Round, class Asset>
AnisotropicNdf<Round> openLevels(const NdfSource<Asset>& source) {
  const Round round = source.normals != nullptr ? Round(source.asset, *source.normals) : Round(source.asset);
  return {round, source.options.footprint_parts};
}

inline NdfInfo levelsInfo(const PyramidShape& shape) {
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
  return info;
}

}  // namespace glint::api
