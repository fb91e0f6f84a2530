#pragma once

#include <string>
#include <vector>

#include "disk_light.h"
#include "glint/api/any_ndf.h"
#include "scene.h"

namespace render {

/// Footprints of pixels: a Gaussian filter of half a pixel, or the box of the same second moments.
enum class Filter : std::uint8_t { gaussian, box };

inline constexpr std::size_t kMostLights = 4;

struct Options {
  Shape shape = Shape::both;
  float distance = 4;                  ///< of the camera, map widths
  std::vector<float> lights = {0.5f};  ///< angular diameters, degrees; at most kMostLights, a radiance for each
  int size = 128;                      ///< of the square picture, pixels
  int samples = 1;                     ///< of a pixel, along each axis
  Vec2 shift;                          ///< of the picture, pixels
  Filter filter = Filter::gaussian;
  bool curvature = false;  ///< widen half vectors by the turning of the surface under a pixel
  float sigma = 0;         ///< deviation of every footprint, texels; 0: footprints from ray differentials
};

/// Pixels, top row first.
struct Picture {
  int size = 0;
  int channels = 0;                   ///< a radiance for each light, then kPlaceChannels
  std::vector<float> pixels;          ///< [row][column][channel]
  int covered = 0;                    ///< pixels that see a surface
  int means = 0;                      ///< questions that a sample asks: parts of all lights
  std::vector<double> mean_radiance;  ///< of each light, over the covered pixels

  /// Half vector towards the middle of the lights, x and y, and the deviation of the footprint in texels; 0 without a surface.
  static constexpr int kPlaceChannels = 3;
};

/// Direct light of disk lights on a surface whose facets are mirrors. The same for any number of threads.
Picture render(const glint::api::OpenedNdf& ndf, const Options& options);

/// Writes an OpenEXR file of floats with the channels radiance.0 and so on, half.x, half.y and sigma.
/// @throws std::runtime_error  with the path and the reason
void write(const Picture& picture, const std::string& path);

}  // namespace render
