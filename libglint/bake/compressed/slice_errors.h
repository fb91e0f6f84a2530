#pragma once

#include <algorithm>
#include <cstddef>
#include <span>
#include <vector>

#include "glint/bake/compressed/error_weights.h"
#include "glint/bake/compressed/floors.h"
#include "glint/bake/compressed/model.h"
#include "glint/bake/compressed/slices.h"

namespace glint::bake {

/// Squared error of a slice under a scale c of its decoded form: error + 2 (1 - c) cross + (1 - c)^2 power.
struct ScaledError {
  float error = 0;  ///< sum of (slice - decoded)^2
  float cross = 0;  ///< sum of (slice - decoded) decoded
  float power = 0;  ///< sum of decoded^2

  double at(double scale) const {
    const double rest = 1 - scale;
    const double sum = error + 2 * rest * cross + rest * rest * power;
    return sum > 0 ? sum : 0;
  }
};

/// Sums over the pixels of a slice and of its decoded form, in units of the peak of the cluster.
struct SliceError {
  ScaledError plain;     ///< of pixels, negative ones included; they are not scaled
  ScaledError seen;      ///< of densities, weighted (ErrorWeights::pixels)
  float seen_scale = 1;  ///< scale of the image with which these densities were decoded
  float sum = 0;         ///< sum of decoded pixels, which are not scaled
  float positive = 0;    ///< the same, of pixels less their floors where that is positive
};

/// Errors of a cluster.
struct ClusterErrors {
  std::vector<SliceError> slices;   ///< of all slices
  std::vector<double> cell_sums;    ///< [levels][cells of a block]: sum of decoded densities over slices and pixels
  std::vector<double> cell_errors;  ///< [levels][cells of a block]: sum of their squared errors
};

/// Scale with which the densities of an image are measured. Scales far from 1 belong to images that lost most of their mass. Large
/// scales would cost ScaledError its precision.
inline float measuredScale(float density_scale) { return std::clamp(density_scale, 0.5f, 2.0f); }

/// Compares slices of a cluster with their decoded forms, one by one.
class SliceComparer {
 public:
  /// @param density_scales  [images]: factors of pixels less their floors where that is positive
  SliceComparer(const SliceIndex& index, const ErrorWeights& weights, std::size_t cluster, const ClusterStatistics& statistics,
                std::span<const float> density_scales);

  /// Takes floors off the pixels of all slices that are added from now on.
  /// @param density  of a pixel of 1 in units of the peak of the cluster
  void setFloors(const ClusterFloors& floors, float density);

  /// Adds the next slice. Slices are given in their order.
  /// @param slice, decoded  [256] scaled pixels
  void add(const float* slice, const float* decoded);

  ClusterErrors take() { return std::move(errors_); }

 private:
  const float* pixelWeights(int level);

  const SliceIndex& index_;
  const ErrorWeights& weights_;
  std::size_t cluster_;
  std::span<const float> density_scales_;
  float unscale_[kBlockPixels];                    // turns a scaled pixel into a pixel, both in units of the peak
  float floors_[kBlockPixels] = {};                // scaled, in units of the peak
  double density_;                                 // density of a pixel of 1 in units of the peak
  std::vector<std::vector<float>> pixel_weights_;  // [levels], empty until a slice needs them
  ClusterErrors errors_;
};

}  // namespace glint::bake
