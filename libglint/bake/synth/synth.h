#pragma once

#include <cstdint>
#include <vector>

#include "glint/math/vec.h"

namespace glint::bake {

/// The procedural surfaces. All are periodic, except flake2d in the sizes that flake2dTiles tells.
enum class SynthKind : std::uint8_t {
  isotropic,    ///< Gaussian random field with a Gaussian power spectrum; its NDF is Beckmann
  brushed,      ///< a Gaussian random field, stretched along u into streaks
  flakes,       ///< Voronoi cells of a jittered grid, each a facet with an orientation from a GTR distribution
  scratches,    ///< bent grooves in all directions
  leather,      ///< rounded pebbles with grooves between them
  weave,        ///< plain weave of two thread directions, with fibres
  twill,        ///< a twill of two over and two under: ridges of threads run diagonally
  silk,         ///< a satin of eight: each warp thread lies over seven weft threads and under one
  bumps,        ///< round bumps of different sizes on flat ground
  scales,       ///< rows of scales, each over the next, as of a fish or a roof
  structured,   ///< square pyramids side by side
  relief,       ///< flat islands with steep walls on flat ground
  wood,         ///< rings of wood along u, each denser towards its end, that wander; grain along them
  anisotropic,  ///< a Gaussian random field, four times as long along u as across
  sawtooth,     ///< ramps along u: three quarters of a period up, one quarter down
  flat,         ///< constant
  grating,      ///< grooves along v, one each period: sinusoidal or blazed
  flake2d,      ///< the flakes of MaterialX's node flake2d (1.39.5), on a flat surface
};

/// The shape of a groove of a grating.
enum class GratingProfile : std::uint8_t {
  sine,    ///< sinusoidal
  blazed,  ///< a ramp that rises over seven eighths of the period and falls over one eighth
};

/// Kind, size and shape of a synthetic map. Lengths are in texels.
struct SynthOptions {
  SynthKind kind = SynthKind::isotropic;
  int width = 512;
  int height = 512;
  std::uint64_t seed = 1;
  /// isotropic, anisotropic, brushed: Beckmann roughness of the noise, across the streaks. flakes: roughness of the GTR
  /// distribution. Of other patterns: roughness of the noise that is added to the pattern; 0: no noise.
  float alpha = 0.1f;
  float gamma = 2;               ///< exponent of the GTR distribution of flakes; 2 is GGX, larger exponents have a shorter tail
  float correlation_texels = 4;  ///< distance at which the correlation of the noise is 1/e (with streaks: across them)
  float streak_texels = 160;     ///< brushed, anisotropic, wood: distance at which the correlation is 1/e along the streaks
  float feature_texels =
      8;  ///< size of a flake, pebble, thread, tooth, groove, bump, scale, pyramid, island or ring; width of a scratch
  float density = 1;   ///< number of scratches in each square of 64 x 64 texels
  float slope = 0.5f;  ///< steepest slope of a pattern; not of flakes and of noise alone
  GratingProfile profile = GratingProfile::sine;
  float flake_size_uv = 0.01f;  ///< flake2d: the node's input size, in widths of the map
  float roughness = 0.1f;       ///< flake2d: the node's input; normals of flakes are distributed as GGX of alpha = roughness^2
  float coverage = 0.5f;        ///< flake2d: the node's input, the share of the map that flakes cover
  float depth_texels = 0;       ///< distance from the lowest to the highest point of the heights; 0: as the slopes give it
};

/// Options with which maps of a kind look typical.
SynthOptions defaultSynthOptions(SynthKind kind);

/// Makes the heights of a periodic procedural surface. Noise is scaled so that the variance of its central-difference slopes is
/// alpha^2 / 2 along each axis (with streaks: across them). A pattern is scaled so that its steepest central-difference slope
/// is `slope`. The result does not depend on the number of threads.
/// @return [height][width], texels, bottom row first
/// @throws Error unsupported for flakes and flake2d, which have no common height field; usage if an option is out of range
std::vector<float> synthHeights(const SynthOptions& options);

/// Makes the normals of a periodic procedural surface: of the heights of synthHeights, or of flakes. A texel of flake2d without a
/// flake is level.
/// @return [height][width], projections on the disk, bottom row first
/// @throws Error usage if an option is out of range
std::vector<Vec2> synthNormals(const SynthOptions& options);

/// Makes the output `presence` of MaterialX's node flake2d: which texels have a flake.
///
/// A texel has the texture coordinate of its centre: u is 0 to 1 over the width of the map, and v has the same scale. The seed
/// 1 gives the flakes of the node. Another seed gives those that the node flake3d has in the plane z = (seed - 1) size. Where
/// flake2dTiles, the cells of the grid repeat so that the map tiles: texels within one cell of the border may differ from the
/// node's. All others are the node's own, by the same hash.
/// @return [height][width], bottom row first: 0 where there is no flake, else a number of the flake in (0, 1]
/// @throws Error usage if the kind is not flake2d, or an option is out of range
std::vector<float> synthPresence(const SynthOptions& options);

/// Whether a map of flake2d tiles: width and height hold whole numbers of cells, to a hundredth of a cell. Otherwise flakes are
/// cut at the border.
bool flake2dTiles(const SynthOptions& options);

/// Smallest cosine of the tilt of a flake: cos(85 degrees). The tail of the GTR distribution beyond is cut off, since an 8-bit
/// image could not tell such flakes from normals that point below the surface.
inline constexpr float kMinFlakeCosine = 0.08715574f;

}  // namespace glint::bake
