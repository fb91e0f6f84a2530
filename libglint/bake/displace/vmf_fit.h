#pragma once

#include <span>
#include <vector>

#include "glint/model/displacement.h"

namespace glint::bake {

/// A direction with its weight.
struct WeightedNormal {
  Vec3 normal;
  float weight = 0;
};

/// Fits von Mises-Fisher lobes to weighted unit normals by expectation maximisation (Wu 2019, Eq. 4; Han et al. 2007).
///
/// Starts from a weighted k-means++ choice with fixed random numbers, so the same normals give the same lobes. A bandwidth is
/// at most kMaxKappa: normals that are all the same give one lobe of kMaxKappa, and empty lobes.
/// @param normals  z > 0; at least one, weights > 0
/// @param lobes    at most kMaxLobes; largest amplitude first, empty lobes with amplitude 0 last. The sum of the amplitudes is
///                 the sum of the weights
void fitLobes(std::span<const WeightedNormal> normals, std::span<VmfLobe> lobes);

/// Averages numbers that normals carry, such as colours, over each lobe. A normal counts by its share in the lobe.
/// @param values  [normals][count]
/// @param means   [lobes][count]: the result; 0 for empty lobes
void averageOverLobes(std::span<const WeightedNormal> normals, std::span<const VmfLobe> lobes, std::span<const float> values,
                      std::span<float> means);

/// Relative error of lobes as a distribution of normals: the distributions of the normals and of the lobes are both blurred by
/// a lobe of 8 degrees and compared at up to 32 of the normals. Norm of the difference over the norm.
float lobeError(std::span<const WeightedNormal> normals, std::span<const VmfLobe> lobes);

}  // namespace glint::bake
