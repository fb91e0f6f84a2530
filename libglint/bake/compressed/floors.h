#pragma once

#include <array>
#include <cstdint>
#include <vector>

#include "glint/bake/compressed/error_weights.h"
#include "glint/model/ndf_cp.h"

namespace glint::bake {

/// The floors of a cluster, as NdfCp stores them. A default value takes nothing off.
struct ClusterFloors {
  std::uint16_t unit = 0;                            ///< NdfCluster::floor_unit
  std::array<std::uint8_t, kFloorCells> codes = {};  ///< NdfCp::floors

  /// @return density that a reader takes off the pixels of a cell
  float at(int cell) const;
};

/// Finds the floors of a cluster.
///
/// A sum of few columns is a little off where the image is dark, and cutting its negative part leaves a haze, on maps of
/// sparse facets above all. A floor is what a reader takes off the pixels
/// of a cell before it cuts them. It is chosen so that the pixels that are left have the mean of the cell, or a little less, over
/// all slices. Light that columns lose stays lost.
class FloorFinder {
 public:
  /// @param density  of a pixel of 1 in units of the peak of the cluster
  FloorFinder(const BlockScale& scale, float density);

  /// Adds a slice.
  /// @param slice, decoded  [256] scaled pixels
  void add(const float* slice, const float* decoded);

  /// @return floors for all slices so far
  ClusterFloors find() const;

 private:
  /// Decoded pixels of one range of values.
  struct Bin {
    double count = 0, sum = 0;
  };

  float floorOf(int cell) const;

  float unscale_[kBlockPixels];  // turns a scaled pixel into a pixel, both in units of the peak
  float density_;
  std::array<double, kFloorCells> truth_ = {};  // sum of the pixels of all slices
  std::vector<Bin> bins_;                       // [cells][bins] of the positive decoded pixels
};

}  // namespace glint::bake
