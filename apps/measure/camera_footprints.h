#pragma once

namespace glint::apps {

/// Footprints that a material is asked for: deviations of round ones, texels.
struct FootprintRange {
  double smallest = 0;
  double largest = 0;
};

/// What a camera sees of a material. Distances are along the camera's axis.
struct CameraView {
  double nearest = 0;            ///< scene units
  double farthest = 0;           ///< scene units
  double field_of_view_deg = 0;  ///< across the columns
  int columns = 0;               ///< pixels
  int samples = 1;               ///< jittered samples of a pixel, each with a footprint of its own
};

/// Deviation of the footprint of a pixel on a surface that faces the camera, scene units: the filter of footprintFromDifferentials.
double pixelFootprint(const CameraView& camera, double distance);

/// Footprints of the nearest and of the farthest view.
/// @param texels_per_unit  texels in a scene unit, > 0
FootprintRange footprintsOfCamera(const CameraView& camera, double texels_per_unit);

}  // namespace glint::apps
