#pragma once

#include <cstddef>
#include <span>
#include <string>
#include <vector>

#include "glint/math/vec.h"

namespace glint::bake {

/// Distant light from all directions, as a latitude-longitude image that is twice as wide as high. z is up.
///
/// Pixel (i, j), bottom row first, has its centre at azimuth 2 pi (i + 0.5) / width, from +x towards +y, and at polar angle
/// pi (1 - (j + 0.5) / height) from +z. Radiance is constant over a pixel.
struct Environment {
  int width = 0;
  int height = 0;
  std::vector<float> rgb;  ///< [height][width][3], finite, >= 0

  /// Pixel that a direction lies in.
  /// @return red, green and blue
  const float* at(Vec3 direction) const;
};

/// Throws unless an environment can be used: not empty, twice as wide as high, and every pixel finite and not negative.
/// @throws Error invalid_input, naming the path and the first bad pixel
void requireUsable(const Environment& environment, const std::string& path = {});

/// Whether any light comes from above the horizon, z > 0. A surface sees no light from below.
bool hasLightAbove(const Environment& environment);

/// Projects an environment on spherical harmonics up to a band: exact integrals over the pixels, in double precision.
/// O(height * band_limit^2), and O(width * log width) for the Fourier transform of every node of the quadrature over the polar
/// angle. At most one thread for each channel.
/// @return [3][shCount(band_limit)], for red, green and blue
std::vector<double> projectEnvironment(const Environment& environment, int band_limit);

/// A rectangle that emits light to the side of axis_u x axis_v. Positions are relative to the shading point, in any unit.
struct RectangleLight {
  Vec3 centre;
  Vec3 axis_u;                    ///< from the centre to the middle of a side
  Vec3 axis_v;                    ///< from the centre to the middle of a neighbouring side
  float radiance[3] = {1, 1, 1};  ///< multiplied by the texture
  int texture_width = 0;          ///< 0: no texture
  int texture_height = 0;
  std::vector<float> texture;  ///< [height][width][3], bottom row first; u along axis_u, v along axis_v
};

/// Whether the shading point is on the side of a rectangle that emits light.
bool facesOrigin(const RectangleLight& light);

/// A sphere that emits light outwards. Its texture has the layout of an Environment.
struct SphereLight {
  Vec3 centre;
  float radius = 1;
  float radiance[3] = {1, 1, 1};
  int texture_width = 0;
  int texture_height = 0;
  std::vector<float> texture;
};

/// Draws area lights as a shading point at the origin sees them: the nearest light in each direction, averaged over
/// samples x samples rays in each pixel. A light that few rays would meet is drawn from its own points instead, so that the light
/// it sends is right however small it is. From inside, a sphere is not seen.
/// @throws Error usage if a size is out of range; invalid_input if a light is degenerate
Environment renderAreaLights(std::span<const RectangleLight> rectangles, std::span<const SphereLight> spheres, int height,
                             int samples);

}  // namespace glint::bake
