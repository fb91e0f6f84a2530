#pragma once

#include <cstdint>
#include <numbers>
#include <vector>

#include "glint/bake/common/progress.h"
#include "glint/bake/pyramid/pyramid.h"
#include "glint/model/normal_map.h"
#include "glint/model/wave_pyramid.h"

namespace glint::bake {

struct WaveOptions {
  float stride = 32;                ///< as PyramidOptions
  float overlap = kDefaultOverlap;  ///< as PyramidOptions
  int resolution = 256;             ///< as PyramidOptions
  int levels = 0;                   ///< as PyramidOptions
  BlockPrecision precision = BlockPrecision::f16;
  float coherence_um = 10;  ///< sigma_c: deviation of the coherence area; from the longest wavelength to the size of the map
  std::vector<float> wavelengths_um;  ///< rising, kLeastWavelengthUm to kMostWavelengthUm, at most kMostWaveChannels
  bool spectral = false;              ///< a channel for each wavelength, instead of X, Y and Z; always so with one wavelength
  /// Coherent images in a deviation of the coherence area, or of the footprints of level 0 where these are smaller, along each axis.
  float kernels = 1;
};

inline constexpr float kLeastWavelengthUm = 0.1f, kMostWavelengthUm = 5;

/// Pixels below this density in every channel of a whole block are not stored; the rest of the image is raised by their light. A
/// three-thousandth of a diffuse surface.
inline constexpr float kWaveFloor = 1e-4f;

/// Largest share of the light of a place that may lie where aliasing begins.
inline constexpr double kMostAliased = 1e-4;

/// What a pyramid was made with.
struct WaveReport {
  double steepest_slope = 0;
  double finest_step_um = 0;                ///< between samples of the surface, at the wavelength that needs the most
  int samples_per_texel = 0;                ///< the same, rounded up
  int kernel_columns = 0, kernel_rows = 0;  ///< grid of coherent images
};

/// A WavePyramid that owns its arrays.
class WavePyramidData {
 public:
  NdfPyramidData grey;
  WavePyramid shape;  ///< without arrays, and without `grey`
  std::vector<float> wavelengths_um;
  std::vector<Rgb> channel_rgb;
  std::vector<std::vector<std::uint16_t>> half_pixels;  ///< [levels], with BlockPrecision::f16
  std::vector<std::vector<float>> float_pixels;         ///< [levels], with BlockPrecision::f32
  WaveReport report;

  /// Spans over the arrays; valid while this object lives and is not changed.
  WavePyramid view() const;
};

/// Deviation of the spot of a flat surface, units of psi: lambda / (4 pi sqrt(2) sigma_c).
inline double spotDeviation(double wavelength_um, double coherence_um) {
  return wavelength_um / (4 * std::numbers::pi * std::numbers::sqrt2 * coherence_um);
}

/// Checks what can be checked without computing: options, and that the size of a texel is known.
/// @throws Error as buildWavePyramid does
void checkWaveOptions(const HeightMap& map, const WaveOptions& options);

/// The memory that the images take while buildWavePyramid makes them, bytes. Where every block of every image would fit into
/// `most_bytes`, it is the bytes of all blocks; otherwise of blocks for the slopes that most texels have.
/// @throws Error as buildWavePyramid does for options
double wavePyramidBytes(const HeightMap& map, const WaveOptions& options, double most_bytes);

/// Builds the NDF images of a height field under wave optics (Deng 2022, Eq. 3 and 4).
///
/// Coherent images come from windowed Fourier transforms on a grid of places; images of level 0 are their means, weighed by the
/// footprints, and coarser images are means of the images below them. Heights are read as a periodic cubic spline; the tool samples
/// it so finely that the phase between samples turns by less than half a turn on the steepest slope.
/// O(places wavelengths size^2 log size); holds the images and some rows of samples. The same bytes on any number of threads.
/// @param map  periodic, with a texel size
/// @throws Error usage for options out of range; invalid_input for a map without a texel size, or too steep
WavePyramidData buildWavePyramid(const HeightMap& map, const WaveOptions& options, const ProgressFn& progress = {});

}  // namespace glint::bake
