#pragma once

#include "glint/math/vec.h"
#include "glint/model/footprint.h"

namespace glint {

/// Mean and covariance of the slopes (dz/dx, dz/dy) = (-nx/nz, -ny/nz) of a map's texels, from which masking follows.
struct MapSlopes {
  Vec2 mean;
  Covariance covariance;  ///< of slopes, dimensionless
};

}  // namespace glint
