#pragma once

#include <complex>
#include <memory>
#include <vector>

#include "glint/bake/wave/height_spline.h"
#include "glint/bake/wave/wave_fft.h"

namespace glint::bake {

/// The grid on which one wavelength is transformed. An image of psi is sampled by a Fourier transform whose samples lie evenly in
/// the pixels, so that their window is lambda samples_per_pixel resolution / 4 long.
struct WaveGrid {
  double wavelength_um = 0;
  double coherence_um = 0;  ///< deviation of the coherence area
  int resolution = 0;       ///< pixels along each axis of the square [-1, 1]^2 of psi
  int samples_per_pixel = 0;
  int size = 0;         ///< samples along each axis of the window, even
  double step_um = 0;   ///< between samples of the surface: |psi| < wavelength / (4 step) is seen without aliasing
  int half_pixels = 0;  ///< pixels that are seen on either side of psi = 0, at most resolution / 2

  int pixels() const { return 2 * half_pixels; }
  double window_um() const { return size * step_um; }
  double largestPsi() const { return wavelength_um / (4 * step_um); }
};

/// @param largest_psi  that the grid is to see, > 0
WaveGrid waveGrid(double wavelength_um, double coherence_um, int resolution, double largest_psi);

/// exp(-i 4 pi h / lambda) at the samples of some rows of a wave grid: the field behind the surface, under light from above.
///
/// Sample (r, c) is at (c step + left, r step). The phase of half a frequency is in the samples, which moves the samples of psi
/// from the borders to the middle of their cells; a constant phase of a window does not change its power.
class PhaseRows {
 public:
  /// @param columns  samples along u, which may go around the map
  PhaseRows(const HeightSpline& spline, double texel_um, const WaveGrid& grid, double left_um, int columns);

  /// Computes rows first to first + count - 1, in parallel. O(count columns).
  void compute(std::ptrdiff_t first, int count);

  const WaveGrid& grid() const { return grid_; }
  double left_um() const { return left_um_; }
  /// A row that was computed.
  const std::complex<float>* row(std::ptrdiff_t r) const {
    return samples_.data() + static_cast<std::size_t>(r - first_) * static_cast<std::size_t>(columns_);
  }

 private:
  const HeightSpline& spline_;
  double texel_um_;
  WaveGrid grid_;
  double left_um_;
  int columns_;
  std::vector<int> places_;         // [columns]: first coefficient
  std::vector<double> weights_[4];  // [columns]
  std::ptrdiff_t first_ = 0;
  std::vector<std::complex<float>> samples_;
};

/// Makes coherent images (Deng 2022, Eq. 3) at places of the surface by windowed Fourier transforms.
class CoherentImager {
 public:
  explicit CoherentImager(const WaveGrid& grid);

  const WaveGrid& grid() const { return grid_; }

  /// Memory of one thread.
  class Scratch {
   public:
    explicit Scratch(const WaveGrid& grid);

   private:
    friend class CoherentImager;
    FftwfBuffer field;             // [size][size]
    std::vector<float> window[2];  // [size]: the coherence area along each axis
    std::vector<float> power;      // [size][size]
    std::vector<float> bands;      // [pixels][size]
  };

  /// Pixel means of D*(x, psi) for a place x.
  ///
  /// Means of pixels are exact sums of the power at the samples, corrected for its course between samples (`taps`). Without light
  /// beyond the grid's largest psi the image sums to 1, but for the part outside [-1, 1]^2. O(size^2 log size).
  /// @param rows  hold all rows within half a window of y
  /// @param out   [grid.pixels()][grid.pixels()] from psi = -half_pixels pixels on, >= 0, integrates over psi
  void image(const PhaseRows& rows, double x_um, double y_um, Scratch& scratch, float* out) const;

  /// Share of the power of a place that is near the border of the samples of psi: of that beyond 0.9 of the largest psi along either
  /// axis. A sign of aliasing.
  double borderShare(const PhaseRows& rows, double x_um, double y_um, Scratch& scratch) const;

 private:
  /// Transforms the windowed field. @return factor from the power of a sample to its share of the light
  double transform(const PhaseRows& rows, double x_um, double y_um, Scratch& scratch) const;

  WaveGrid grid_;
  FftwfPlan plan_;
  std::vector<float> taps_;  // weights of the samples of a pixel and of kTapReach more on either side
};

}  // namespace glint::bake
