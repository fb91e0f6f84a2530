#pragma once

#include <cstdint>
#include <vector>

#include "glint/bake/compressed/slices.h"

namespace glint::bake {

/// One spot of a slice, in the units of the slice.
struct Spot {
  std::uint8_t x = 0;  ///< as in NdfSpot
  std::uint8_t y = 0;
  float weight = 0;  ///< sum of the whole spot, > 0
  float gain = 0;    ///< how much it lowers the squared error
};
using SliceSpots = std::vector<Spot>;

/// Finds the spots that make up a slice: matching pursuit with Gaussians of the pyramid's intrinsic roughness.
class SpotFinder {
 public:
  /// @param sigma_pixels  of a spot
  explicit SpotFinder(float sigma_pixels);

  /// Whether spots of this size can be told from one another by eighths of a pixel, and end within kSpotReach.
  static bool suits(float sigma_pixels) { return sigma_pixels >= 0.3f && sigma_pixels <= 1; }

  /// @param slice  [256]; replaced by what the spots leave
  /// @param least  gains below this end the search
  /// @return at most `most` spots, gains not rising
  SliceSpots find(float* slice, int most, float least) const;

  /// As NdfCp::spot_sums.
  const std::vector<float>& sums() const { return sums_; }
  /// Share of a spot that lies in the block.
  float share(const Spot& spot) const { return shares_[spot.x] * shares_[spot.y]; }
  /// Adds a spot to the pixels of a block.
  void add(int x, int y, float weight, float* pixels) const;

 private:
  const float* profile(int place) const { return profiles_.data() + place * kBlockSize; }
  float match(const float* slice, int x, int y) const;
  void refine(const float* slice, int& x, int& y, float& best) const;

  std::vector<float> sums_;
  std::vector<float> profiles_;  // [places][16]
  std::vector<float> norms_;     // [places]: of the profiles
  std::vector<float> shares_;    // [places]: sums of the profiles
  int reach_;                    // pixels
};

}  // namespace glint::bake
