#pragma once

#include <array>
#include <cstddef>
#include <span>
#include <vector>

#include "glint/bake/displace/brdf_scene.h"
#include "glint/model/displacement.h"

namespace glint::bake {

/// Part of the samples of one patch.
struct SampleChunk {
  int patch;
  std::size_t first, last;
};

/// Cuts the samples of all patches in chunks, whose sums floats can hold.
std::vector<SampleChunk> makeChunks(const std::vector<PatchFacets>& patches);

/// What a chunk adds up.
struct ChunkSums {
  std::vector<float> pairs;  ///< [channels][padded directions][padded directions]
  std::vector<float> areas;  ///< [padded directions]: visible projected area
};

/// Zeros.
ChunkSums emptySums(const BrdfScene& scene);

/// Light that was followed: all, scattered more than once, and over hops longer than each of the distances.
struct LightShares {
  double all = 0, interreflected = 0;
  std::array<double, kMaxDisplacementLevels> distant = {};

  void addHop(double light, float longest, std::span<const float> distances) {
    interreflected += light;
    for (std::size_t k = 0; k < distances.size(); ++k) distant[k] += longest > distances[k] ? light : 0;
  }
  void add(const LightShares& other) {
    all += other.all, interreflected += other.interreflected;
    for (std::size_t k = 0; k < distant.size(); ++k) distant[k] += other.distant[k];
  }
};

/// The estimates of all patches, and the areas that correct them.
class BrdfSums {
 public:
  explicit BrdfSums(const BrdfScene& scene);

  double& at(std::size_t channel, std::size_t patch, std::size_t i, std::size_t o) {
    return values_[((channel * patches_ + patch) * directions_ + i) * directions_ + o];
  }
  /// [channels][patches][directions][directions]
  std::vector<double>& values() { return values_; }

  /// Adds a chunk of a patch that has so many samples.
  /// @param scale  factor that the pairs of the chunk lack
  void addChunk(const BrdfScene& scene, const SampleChunk& chunk, const ChunkSums& sums, double samples, double scale);

  /// Makes the estimates symmetric, since both halves estimate the same function, and their visible areas exact: the projected
  /// area that a periodic surface shows to a direction is its cosine (Wu 2019, Eq. 8), so what the masks show too much or too
  /// little of is known.
  EffectiveBrdf finish(const BrdfScene& scene, const LightShares& shares) const;

 private:
  std::vector<double> corrections(const BrdfScene& scene) const;

  std::size_t patches_, directions_;
  std::vector<double> values_;
  std::vector<double> areas_;  ///< [directions]: visible projected area of the whole map
};

}  // namespace glint::bake
