#pragma once

#include "glint/bake/pyramid/pyramid.h"

namespace glint::test {

/// Three levels of 64^2 pixels: enough to compress, and quick.
inline bake::NdfPyramidData smallPyramid(const NormalMap& map) {
  bake::PyramidOptions o;
  o.stride = 16;
  o.resolution = 64;
  o.sigma_r = 0.02f;
  o.levels = 3;
  return bake::buildPyramid(map, o);
}

}  // namespace glint::test
