#pragma once

#include <cmath>

#include "glint/math/vec.h"

namespace glint {

/// Two unit vectors that form a right-handed frame with a given unit vector (Duff et al. 2017).
struct Tangents {
  Vec3 s, t;
};
inline GLINT_HD Tangents tangentsOf(Vec3 n) {
  const float sign = std::copysign(1.0f, n.z), a = -1 / (sign + n.z), b = n.x * n.y * a;
  return {{1 + sign * n.x * n.x * a, sign * b, -sign * n.x}, {b, sign + n.y * n.y * a, -n.y}};
}

}  // namespace glint
