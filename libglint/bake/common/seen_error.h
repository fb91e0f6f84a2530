#pragma once

#include <vector>

namespace glint::bake {

/// Densities below this count as this in relative errors. A diffuse surface has a density of 1 / pi.
inline constexpr double kDarkestSeen = 1e-3;

/// Cells of half vectors along each axis of the disk for seen errors.
inline constexpr int kSeenCells = 64;

/// @param resolution  pixels of an NDF image along each axis, a multiple of 16
/// @return pixels of a cell along each axis, a power of two in 1..16: as near to 1/64 of the image as whole blocks allow
int seenCellPixels(int resolution);

/// What a person sees of an error, over one size of footprints.
struct SeenSummary {
  double seen = 0;   ///< root mean square of the error e(h) over all lit cells h
  double worst = 0;  ///< largest e(h)
  double bias = 0;   ///< largest b(h)
};

/// The seen error of NDF images of many places x towards each half vector h.
///
/// A flat surface under a distant light shows the density of many places towards one half vector. A person compares the error
/// there with what the surface reflects there. Cells h are 1/64 of the disk's width; squares and means are pooled over their
/// pixels:
///   e(h) = sqrt(mean_x (D' - D)^2) / max(sqrt(mean_x D^2), d),  b(h) = |mean_x (D' - D)| / max(mean_x D, d),
/// with d = kDarkestSeen. A cell is lit if D or D' exceeds d in any of its pixels, at any place.
class SeenError {
 public:
  explicit SeenError(int resolution);

  /// Adds the images of one place.
  /// @param image, truth  [resolution][resolution] densities of the model and of the truth
  void add(const float* image, const float* truth);

  /// Adds the truth of a place where the model was not asked. Errors then relate to the light of more places: on a map with few
  /// facets, few places do not tell how much light a half vector has.
  void addTruth(const float* truth);

  /// @return errors over all places so far; zeros without any
  SeenSummary summary() const;

  /// e(h) of every cell, [cells][cells], 0 where the cell is not lit. Bottom row first.
  std::vector<double> errors() const;

 private:
  struct Cell {
    double error2 = 0, truth2 = 0;  // sums of squares over pixels and places
    double difference = 0, truth = 0;
    bool lit = false;
  };

  double errorOf(const Cell& cell) const;

  int resolution_, cell_pixels_, cells_;
  double places_ = 0, truth_places_ = 0;
  std::vector<Cell> sums_;  // [cells][cells]
};

}  // namespace glint::bake
