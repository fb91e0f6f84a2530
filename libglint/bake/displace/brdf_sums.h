#pragma once

#include <array>
#include <cstddef>
#include <span>
#include <vector>

#include "glint/bake/displace/brdf_scene.h"
#include "glint/model/displacement.h"

namespace glint::bake {

/// Some samples of one patch, for one task.
struct SampleChunk {
  int patch;
  std::size_t first, last;
};

/// Cuts the samples of all patches into chunks so short that floats can hold their sums.
std::vector<SampleChunk> makeChunks(const std::vector<PatchFacets>& patches);

/// Sums over the samples of a chunk.
struct ChunkSums {
  std::vector<float> pairs;  ///< [channels][padded directions][padded directions]: reflected light
  std::vector<float> areas;  ///< [padded directions]: visible projected area
};

/// Sums of no samples.
ChunkSums emptySums(const BrdfScene& scene);

/// Size of the sums of a chunk.
std::size_t chunkBytes(const BrdfScene& scene);

/// Amounts of light on the paths that an estimator followed.
/// `all`: all light. `interreflected`: light that was scattered more than once. `distant[k]`: light whose path has a hop longer
/// than distant_cells[k] of the options.
struct LightShares {
  double all = 0, interreflected = 0;
  std::array<double, kMaxDisplacementLevels> distant = {};

  /// Adds light that was scattered again after a path whose longest hop is `longest`.
  void addHop(double light, float longest, std::span<const float> distances) {
    interreflected += light;
    for (std::size_t k = 0; k < distances.size(); ++k) distant[k] += longest > distances[k] ? light : 0;
  }
  void add(const LightShares& other) {
    all += other.all, interreflected += other.interreflected;
    for (std::size_t k = 0; k < distant.size(); ++k) distant[k] += other.distant[k];
  }
};

/// Sums over all samples of every patch, and the visible areas that correct the estimates.
class BrdfSums {
 public:
  explicit BrdfSums(const BrdfScene& scene);

  double& at(std::size_t channel, std::size_t patch, std::size_t i, std::size_t o) {
    return values_[((channel * patches_ + patch) * directions_ + i) * directions_ + o];
  }
  /// Reflected light of all pairs, [channels][patches][directions][directions].
  std::vector<double>& values() { return values_; }

  /// Adds the sums of a chunk.
  /// @param samples  number of samples of the chunk's patch
  /// @param scale    constant factor of the BRDF that the sums lack
  void addChunk(const BrdfScene& scene, const SampleChunk& chunk, const ChunkSums& sums, double samples, double scale);

  /// Turns sums into effective BRDFs. Pairs (i, o) and (o, i) estimate the same number, so each gets the mean of both. Visible
  /// areas are made exact: a periodic surface shows a direction a projected area equal to the direction's cosine (Wu 2019,
  /// Eq. 8), so the error of the masks is known and divided out.
  EffectiveBrdf finish(const BrdfScene& scene, const LightShares& shares) const;

 private:
  std::vector<double> corrections(const BrdfScene& scene) const;

  std::size_t patches_, directions_;
  std::vector<double> values_;
  std::vector<double> areas_;  ///< [directions]: visible projected area of the whole map
};

}  // namespace glint::bake
