#pragma once

#include <span>
#include <vector>

#include "glint/bake/displace/effective_brdf.h"

namespace glint::bake {

/// The scaling function R = original / low, factored as T(x) S(wi, wo), and the error of the factors (Wu 2019, section 6).
struct ScalingFactors {
  std::vector<float> spatial;  ///< T [patches], mean 1
  std::vector<float> angular;  ///< S [directions (directions + 1) / 2], (i, o) with i <= o at o (o + 1) / 2 + i
  float rank1_residual = 0;    ///< |R - T S| / |R|, over pairs of directions that are not grazing
  float rank1_energy = 1;      ///< square of the largest singular value of R over |R|^2: 1 if some T S equals R
};

/// Factors R, [patches][directions][directions], of one channel as T and S.
///
/// T is the mean over directions of R relative to R of the whole map (Eq. 22). The mean is weighted by reflected light, so that
/// pairs which reflect next to nothing do not add their noise. S is then the ratio of sums over the map (Eq. 24, weighted by T
/// and the denominators), so that the effective BRDF of the whole map equals the original's exactly.
ScalingFactors factorScaling(const EffectiveBrdf& original, const EffectiveBrdf& low, std::span<const Vec3> directions,
                             const PatchGrid& grid, std::size_t channel = 0);

}  // namespace glint::bake
