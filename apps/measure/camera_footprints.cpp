#include "measure/camera_footprints.h"

#include <cmath>
#include <numbers>

#include "glint/query/ray_footprint.h"

namespace glint::apps {

double pixelFootprint(const CameraView& camera, double distance) {
  const double half_angle = camera.field_of_view_deg * std::numbers::pi / 360;
  const double between_pixels = 2 * distance * std::tan(half_angle) / camera.columns;
  return double{sampleFilterSigma(camera.samples)} * between_pixels;
}

FootprintRange footprintsOfCamera(const CameraView& camera, double texels_per_unit) {
  return {pixelFootprint(camera, camera.nearest) * texels_per_unit, pixelFootprint(camera, camera.farthest) * texels_per_unit};
}

}  // namespace glint::apps
