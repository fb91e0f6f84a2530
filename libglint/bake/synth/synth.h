#pragma once

#include <cstdint>
#include <vector>

#include "glint/math/vec.h"

namespace glint::bake {

/// The procedural surfaces. All are periodic.
enum class SynthKind : std::uint8_t {
  isotropic,  ///< Gaussian random field with a Gaussian power spectrum; its NDF is Beckmann
  brushed,    ///< the same, stretched along u into streaks
  flakes,     ///< Voronoi facets on a jittered grid, orientations from a GTR distribution
  scratches,  ///< bent grooves in all directions
  leather,    ///< rounded pebbles with grooves between them
  weave,      ///< plain weave of two thread directions, with fibres
  sawtooth,   ///< ramps along u: three quarters of a period up, one quarter down
  flat,       ///< constant
};

/// What shapes a synthetic map. Lengths are in texels.
struct SynthOptions {
  SynthKind kind = SynthKind::isotropic;
  int width = 512;
  int height = 512;
  std::uint64_t seed = 1;
  /// Beckmann roughness of the noise (isotropic, brushed across the streaks), of the noise added to the pattern (scratches,
  /// leather, weave, sawtooth); of the GTR distribution for flakes. 0: no noise.
  float alpha = 0.1f;
  float gamma = 2;               ///< exponent of the GTR distribution of flakes; 2 is GGX, more is a shorter tail
  float correlation_texels = 4;  ///< distance at which the noise's correlation is 1/e (brushed: across the streaks)
  float streak_texels = 160;     ///< the same along the streaks of brushed
  float feature_texels = 8;      ///< size of a flake, pebble, thread, tooth, or width of a scratch
  float density = 1;             ///< scratches in each square of 64 x 64 texels
  float slope = 0.5f;            ///< steepest slope of the pattern: scratches, leather, weave, sawtooth
};

/// Parameters that look right for a kind.
SynthOptions defaultSynthOptions(SynthKind kind);

/// Heights of a periodic procedural surface. Same result for any number of threads.
/// @return [height][width], texels, bottom row first. The noise is scaled so that the variance of its central-difference slopes
/// is
///         alpha^2 / 2 per axis (brushed: across); a pattern so that its steepest central-difference slope is `slope`
/// @throws Error unsupported for flakes, which have no common height field; usage if a parameter is out of range
std::vector<float> synthHeights(const SynthOptions& options);

/// Normals of a periodic procedural surface: of synthHeights by normalsFromHeights, or of the flakes.
/// @return [height][width], projections on the disk, bottom row first
/// @throws Error usage if a parameter is out of range
std::vector<Vec2> synthNormals(const SynthOptions& options);

/// Flakes lean at most this much: cos(85 degrees). Steeper ones of the GTR distribution's tail are left out, since an 8-bit
/// image could not tell them from normals that point below the surface.
inline constexpr float kMinFlakeCosine = 0.08715574f;

}  // namespace glint::bake
