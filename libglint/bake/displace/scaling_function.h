#pragma once

#include <array>
#include <span>
#include <vector>

#include "glint/bake/displace/effective_brdf.h"
#include "glint/model/displacement.h"

namespace glint::bake {

/// One product of a factor by position and a factor by directions.
struct ScalingTerm {
  std::vector<float> spatial;  ///< T [patches]
  std::vector<float> angular;  ///< S [directions (directions + 1) / 2], (i, o) with i <= o at o (o + 1) / 2 + i
};

/// The scaling function R = original / low, factored as T(x) S(wi, wo) or as a sum of such terms, and the errors of the factors
/// (Wu 2019, section 6). Errors and singular values are over pairs of directions that are not grazing.
struct ScalingFactors {
  std::vector<ScalingTerm> terms;  ///< first T, of mean 1, and S, neither negative; others have either sign
  float rank1_residual = 0;        ///< |R - T S| / |R| of one term, S as it is stored
  float residual = 0;      ///< |R - sum of the terms| / |R|, the sum as queries answer it: of stored factors, not below 0
  float rank1_energy = 1;  ///< square of the largest singular value of R over |R|^2: 1 if some T S equals R
  std::array<float, kMostScaleTerms> singular_shares = {1};  ///< squares of the largest singular values over |R|^2 (Fig. 6)
};

/// Factors R, [patches][directions][directions], of one channel.
///
/// T is the mean over directions of R relative to R of the whole map (Eq. 22). The mean is weighted by reflected light, so that
/// pairs which reflect next to nothing do not add their noise. S is then the ratio of sums over the map (Eq. 24, weighted by T
/// and the denominators), so that the effective BRDF of the whole map equals the original's exactly.
///
/// If the residual of T S is above the tolerance, terms are added until it is not. Their spatial factors are the left singular
/// vectors of the part of R - T S across T, the largest first. For each pair of directions the angular factors of all terms
/// are those of the least squared error, weighted by the light of the denominators, among those with which the whole map
/// still reflects what the original does. Where a patch would have a sum below 0, they are moved towards T S until it has not.
/// So sums are nowhere negative, also between patches and between directions, but for rounding.
/// @param tolerance  largest residual; with 0 there is one term
/// @return as many terms as the tolerance needs, at most kMostScaleTerms and the number of patches
/// @note in parallel; results do not depend on the number of threads
ScalingFactors factorScaling(const EffectiveBrdf& original, const EffectiveBrdf& low, std::span<const Vec3> directions,
                             const PatchGrid& grid, std::size_t channel = 0, float tolerance = 0);

}  // namespace glint::bake
