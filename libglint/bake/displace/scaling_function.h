#pragma once

#include <span>
#include <vector>

#include "glint/bake/displace/effective_brdf.h"

namespace glint::bake {

/// The scaling function R = original / low in factors T(x) S(wi, wo), and how well they represent it (Wu 2019, section 6).
struct ScalingFactors {
  std::vector<float> spatial;  ///< T [patches], mean 1
  std::vector<float> angular;  ///< S [directions (directions + 1) / 2], (i, o) with i <= o at o (o + 1) / 2 + i
  float rank1_residual = 0;    ///< |R - T S| / |R|, pairs that are not grazing
  float rank1_energy = 1;      ///< share of the square of the largest singular value of R
};

/// Reduces R [patches][directions][directions] of one channel to T and S.
///
/// T is the mean over directions of R relative to that of the whole map (Eq. 22), weighted by reflected light instead of
/// evenly, so that pairs which reflect next to nothing do not add their noise; then S is the ratio of the sums over the map
/// (Eq. 24, weighted by T and the denominators): the effective BRDF of the whole map is exactly the original's.
ScalingFactors factorScaling(const EffectiveBrdf& original, const EffectiveBrdf& low, std::span<const Vec3> directions,
                             const PatchGrid& grid, std::size_t channel = 0);

}  // namespace glint::bake
