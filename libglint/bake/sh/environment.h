#pragma once

#include <cstddef>
#include <span>
#include <string>
#include <vector>

#include "glint/math/vec.h"

namespace glint::bake {

/// Distant light all around, as a latitude-longitude image of twice the width of its height. z is up.
///
/// Pixel (i, j), bottom row first, is centred at azimuth 2 pi (i + 0.5) / width, from +x towards +y, and at the polar angle
/// pi (1 - (j + 0.5) / height) from +z. Its radiance is constant over the pixel.
struct Environment {
  int width = 0;
  int height = 0;
  std::vector<float> rgb;  ///< [height][width][3], finite, >= 0

  /// Pixel that a direction falls into; three numbers.
  const float* at(Vec3 direction) const;
};

/// Throws Error invalid_input, naming the path and the first bad pixel, unless the environment can be used: not empty, 2:1, and
/// every pixel finite and not negative.
void requireUsable(const Environment& environment, const std::string& path = {});

/// Whether any light comes from above the horizon, z > 0: a surface sees no other.
bool hasLightAbove(const Environment& environment);

/// Spherical harmonics of an environment up to a band: exact integrals over the pixels, in double.
/// @return [3][shCount(band_limit)], R, G, B
/// O(height * band_limit^2), and O(width * height log width) for the rows
std::vector<double> projectEnvironment(const Environment& environment, int band_limit);

/// A rectangle that emits to the side of axis_u x axis_v. Positions are relative to the shading point, in the same units.
struct RectangleLight {
  Vec3 centre;
  Vec3 axis_u;  ///< half axes
  Vec3 axis_v;
  float radiance[3] = {1, 1, 1};  ///< times the texture
  int texture_width = 0;          ///< 0: no texture
  int texture_height = 0;
  std::vector<float> texture;  ///< [height][width][3], bottom row first; u along axis_u, v along axis_v
};

/// Whether the shading point is on the side of a rectangle that emits.
bool facesOrigin(const RectangleLight& light);

/// A sphere that emits outwards; its texture is laid out as an Environment.
struct SphereLight {
  Vec3 centre;
  float radius = 1;
  float radiance[3] = {1, 1, 1};
  int texture_width = 0;
  int texture_height = 0;
  std::vector<float> texture;
};

/// What a shading point at the origin sees of area lights: the nearest one in each direction, averaged over samples x samples
/// rays in each pixel. Nothing of a sphere is seen from inside.
/// @throws Error usage if a size is out of range; invalid_input if a light is degenerate
Environment renderAreaLights(std::span<const RectangleLight> rectangles, std::span<const SphereLight> spheres, int height,
                             int samples);

}  // namespace glint::bake
