#pragma once

#include <cstdint>
#include <vector>

#include "glint/bake/compressed/error_weights.h"
#include "glint/bake/compressed/slices.h"

namespace glint::bake {

/// One spot of a slice, in the units of the slice's pixels.
struct Spot {
  std::uint8_t x = 0;  ///< position, as in NdfSpot
  std::uint8_t y = 0;
  float weight = 0;  ///< sum of the whole spot, > 0
  float gain = 0;    ///< amount by which the spot lowers the squared error
};
using SliceSpots = std::vector<Spot>;

/// Prefix sums of a spot's profile, as NdfCp::spot_sums.
/// @param sigma_pixels  deviation of a spot
std::vector<float> spotSums(float sigma_pixels);

/// Finds the spots whose sum is nearest to a slice: matching pursuit with Gaussians of the pyramid's intrinsic roughness.
///
/// Slices are given in a scaled domain, in which errors are measured. Weights and shares of spots are those of spots that are
/// not scaled.
class SpotFinder {
 public:
  /// @param sigma_pixels  deviation of a spot
  /// @param scale         of the slices' pixels
  SpotFinder(float sigma_pixels, const BlockScale& scale);

  /// Whether spots of this deviation can be stored: positions in eighths of a pixel place them finely enough, and they end
  /// within kSpotReach.
  static bool suits(float sigma_pixels) { return sigma_pixels >= 0.3f && sigma_pixels <= 1; }

  /// @param slice  [256]; replaced by the difference of the slice and its spots
  /// @param least  a gain below this ends the search
  /// @return at most `most` spots, gains not rising
  SliceSpots find(float* slice, int most, float least) const;

  /// Adds a spot to the scaled pixels of a block.
  void add(int x, int y, float weight, float* pixels) const;

  /// Sum over the pixels of an even density of 1, squared.
  float evenPower() const { return even_power_; }
  /// Dot product of a slice with an even density of 1. Over evenPower(), this is the even density nearest to the slice.
  float evenMatch(const float* slice) const;
  /// Dot product of a spot of weight 1 with an even density of 1.
  float evenShare(const Spot& spot) const { return x_.even[spot.x] * y_.even[spot.y]; }
  /// Even density, >= 0, that stands for what spots leave of a slice: the nearest one, or 0 where it would explain little of it, as
  /// where few facets are left. An even density would show these as a haze in the dark.
  /// @param match  evenMatch() of what is left
  /// @param left   sum of its squares
  float restDensity(float match, float left) const;
  /// Writes an even density to the scaled pixels of a block.
  void setEven(float density, float* pixels) const;

 private:
  /// Profiles of spots along one axis, by position, in the scaled domain.
  struct Axis {
    explicit Axis(const std::vector<float>& sums, const float* scale);
    const float* profile(int place) const { return profiles.data() + static_cast<std::size_t>(place) * kBlockSize; }

    std::vector<float> profiles;  // [positions][16]: masses of a spot in the pixels
    std::vector<float> norms;     // [positions]: norms of the profiles
    std::vector<float> inside;    // [positions]: norms of the profiles that are not scaled
    std::vector<float> even;      // [positions]: dot products with an even density
  };
  float match(const float* slice, int x, int y) const;
  void refine(const float* slice, int& x, int& y, float& best) const;

  BlockScale scale_;
  Axis x_, y_;
  float even_power_;
  int reach_;  // pixels on either side that a spot reaches
};

}  // namespace glint::bake
