#pragma once

#include <cstdint>
#include <vector>

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

/// Finds the spots whose sum is nearest to a slice: matching pursuit with Gaussians of the pyramid's intrinsic roughness.
class SpotFinder {
 public:
  /// @param sigma_pixels  deviation of a spot
  explicit SpotFinder(float sigma_pixels);

  /// Whether spots of this deviation can be stored: positions in eighths of a pixel place them finely enough, and they end
  /// within kSpotReach.
  static bool suits(float sigma_pixels) { return sigma_pixels >= 0.3f && sigma_pixels <= 1; }

  /// @param slice  [256]; replaced by the difference of the slice and its spots
  /// @param least  a gain below this ends the search
  /// @return at most `most` spots, gains not rising
  SliceSpots find(float* slice, int most, float least) const;

  /// Prefix sums of a spot's profile, as NdfCp::spot_sums.
  const std::vector<float>& sums() const { return sums_; }
  /// Share of a spot's mass that lies in the block.
  float share(const Spot& spot) const { return shares_[spot.x] * shares_[spot.y]; }
  /// Adds a spot to the pixels of a block.
  void add(int x, int y, float weight, float* pixels) const;

 private:
  const float* profile(int place) const { return profiles_.data() + place * kBlockSize; }
  float match(const float* slice, int x, int y) const;
  void refine(const float* slice, int& x, int& y, float& best) const;

  std::vector<float> sums_;
  std::vector<float> profiles_;  // [positions][16]: masses of a spot in the pixels along an axis
  std::vector<float> norms_;     // [positions]: norms of the profiles
  std::vector<float> shares_;    // [positions]: sums of the profiles
  int reach_;                    // pixels on either side that a spot reaches
};

}  // namespace glint::bake
