#pragma once

#include <cstdint>
#include <vector>

#include "glint/bake/sh/environment.h"
#include "glint/math/spherical_gaussian.h"

namespace glint::bake {

/// Most spherical Gaussians that an environment is fitted with.
inline constexpr int kMostGaussians = 256;

struct GaussianFitOptions {
  int lobes = 32;    ///< 1 to kMostGaussians; fewer come out where the light has fewer pixels
  int height = 128;  ///< rows to which a larger environment is averaged first; lobes are no narrower than its pixels
  int rounds = 60;   ///< of expectation and maximisation
  std::uint64_t seed = 1;
};

/// Spherical Gaussians that stand for an environment.
struct GaussianFit {
  std::vector<SphericalGaussian> lobes;  ///< the most powerful first
  double error = 0;  ///< root mean square over directions and colours of the difference, over that of the light
};

/// Fits spherical Gaussians to an environment (Deng 2022, section 5.4, after Tsai and Shih 2006, who minimise the squared
/// error by descent).
///
/// Axes and sharpness are those of a mixture of von Mises-Fisher lobes with the greatest likelihood, each pixel counting by its
/// brightness and solid angle: found by expectation and maximisation from the best of a few starts. Amplitudes, not negative,
/// then have the least squared error in each colour, and are scaled so that each colour keeps the light of the environment.
/// Deterministic, for any number of threads. O(rounds * lobes * pixels).
/// @throws Error usage if an option is out of range; invalid_input if the environment cannot be used (requireUsable) or is
///         black
GaussianFit fitGaussians(const Environment& environment, const GaussianFitOptions& options);

}  // namespace glint::bake
