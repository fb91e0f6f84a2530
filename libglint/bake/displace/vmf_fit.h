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
/// Starts from a weighted k-means++ choice with fixed random numbers, so the same normals give the same lobes. Bandwidths are
/// at most kMaxKappa: normals that are all the same give one lobe of that bandwidth and empty lobes.
/// @param normals  z > 0; at least one, weights > 0
/// @param lobes    at most kMaxLobes; largest amplitude first, empty lobes last with amplitude 0. Amplitudes add up to the
///                 weights
void fitLobes(std::span<const WeightedNormal> normals, std::span<VmfLobe> lobes);

/// Means over each lobe of numbers that normals carry, weighted by the normals' shares in it: the lobe's colour, say.
/// @param values  [normals][count]
/// @param means   [lobes][count]; 0 for empty lobes
void averageOverLobes(std::span<const WeightedNormal> normals, std::span<const VmfLobe> lobes, std::span<const float> values,
                      std::span<float> means);

/// How well lobes represent normals: both distributions blurred by a lobe of 8 degrees, compared at up to 32 of the normals;
/// norm of the difference over the norm.
float lobeError(std::span<const WeightedNormal> normals, std::span<const VmfLobe> lobes);

}  // namespace glint::bake
