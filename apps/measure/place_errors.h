#pragma once

#include <vector>

#include "glint/api/any_ndf.h"
#include "glint/model/footprint.h"
#include "glint/model/normal_map.h"

namespace glint::apps {

/// The seen error of a model over some places of a map, and how far other places may be from it.
struct PlaceErrors {
  double seen = 0;       ///< seen error over the places
  double deviation = 0;  ///< standard deviation of `seen` over choices of as many places
  double bias = 0;       ///< seen error of the mean over all places: the part that no number of places averages out
  int places = 0;
};

/// The exact NDF images of a map at some places, made when they are asked for, and its light at more of them.
class PlaceTruth {
 public:
  /// Pixels of an image along each axis.
  static constexpr int kResolution = 128;

  /// @param map         must outlive this object
  /// @param footprints  those at which models are asked, and after them more of the same size, of which only the light counts: few
  ///                    places do not tell what the map reflects to half vectors that few places show
  /// @param asked       footprints of the first kind
  /// @param light_deg   angular diameter of the light under which errors are seen, degrees: images are blurred by it
  PlaceTruth(const NormalMap& map, std::vector<Footprint> footprints, std::size_t asked, float sigma_r, double light_deg);

  int places() const { return static_cast<int>(footprints_.size()); }

 private:
  friend class PlaceSample;
  /// Makes the images of the first places, unless they are known.
  void makeImages(std::size_t places);

  NormalMap map_;
  float sigma_r_;
  std::vector<Footprint> footprints_;
  double light_deg_;
  std::vector<std::vector<float>> images_;  // of the first places
  std::vector<double> light2_;              // [cells] mean square density, at least that of the darkest light that is seen
  std::vector<unsigned char> lit_;          // [cells] whether light is seen there
};

/// The errors of one model at the first places of a truth.
class PlaceSample {
 public:
  /// @param truth, ndf  must outlive this object
  PlaceSample(PlaceTruth& truth, const api::OpenedNdf& ndf) : truth_(truth), ndf_(ndf), lit_(truth.lit_) {}

  /// Errors over the first places; those that were asked before are kept.
  /// @param places     at least 2, at most those of the truth
  /// @param longest_s  of all processors, after which a slow model is asked no more; then there are fewer places, at least kFewest
  PlaceErrors ask(int places, double longest_s);

  static constexpr int kFewest = 12;

 private:
  void askNext();
  PlaceErrors errors() const;

  PlaceTruth& truth_;
  const api::OpenedNdf& ndf_;
  std::vector<unsigned char> lit_;
  std::vector<std::vector<double>> squares_, differences_;  // [place][cell] means over the cell's pixels
  double seconds_ = 0;
};

}  // namespace glint::apps
