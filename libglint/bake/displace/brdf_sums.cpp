#include "glint/bake/displace/brdf_sums.h"

#include <algorithm>
#include <cmath>

namespace glint::bake {
namespace {

constexpr std::size_t kChunkSamples = 8192;  // samples whose sum a float holds exactly enough
constexpr double kMostCorrection = 1.25;     // largest factor that corrects a visible area

}  // namespace

std::vector<SampleChunk> makeChunks(const std::vector<PatchFacets>& patches) {
  std::vector<SampleChunk> chunks;
  for (std::size_t p = 0; p < patches.size(); ++p)
    for (std::size_t s = 0; s < patches[p].samples(); s += kChunkSamples)
      chunks.push_back({static_cast<int>(p), s, std::min(s + kChunkSamples, patches[p].samples())});
  return chunks;
}

ChunkSums emptySums(const BrdfScene& scene) {
  const std::size_t padded = scene.directions.padded;
  return {std::vector<float>(scene.channels() * padded * padded), std::vector<float>(padded)};
}

std::size_t chunkBytes(const BrdfScene& scene) {
  const std::size_t padded = scene.directions.padded;
  return (scene.channels() * padded + 1) * padded * sizeof(float);
}

BrdfSums::BrdfSums(const BrdfScene& scene)
    : patches_(static_cast<std::size_t>(scene.grid.count())),
      directions_(scene.directions.count),
      values_(scene.channels() * patches_ * directions_ * directions_),
      areas_(directions_) {}

void BrdfSums::addChunk(const BrdfScene& scene, const SampleChunk& chunk, const ChunkSums& sums, double samples, double scale) {
  const std::size_t padded = scene.directions.padded;
  for (std::size_t i = 0; i < directions_; ++i) {
    areas_[i] += scene.grid.share(chunk.patch) * sums.areas[i] / samples;
    for (std::size_t c = 0; c < scene.channels(); ++c)
      for (std::size_t o = 0; o < directions_; ++o)
        at(c, static_cast<std::size_t>(chunk.patch), i, o) += scale / samples * sums.pairs[(c * padded + i) * padded + o];
  }
}

/// Factors of the directions that make the visible areas exact.
std::vector<double> BrdfSums::corrections(const BrdfScene& scene) const {
  std::vector<double> corrections(directions_, 1.0);
  for (std::size_t d = 0; d < directions_; ++d)
    if (areas_[d] > 0) corrections[d] = std::clamp(scene.directions.z[d] / areas_[d], 1 / kMostCorrection, kMostCorrection);
  return corrections;
}

EffectiveBrdf BrdfSums::finish(const BrdfScene& scene, const LightShares& shares) const {
  EffectiveBrdf result;
  result.directions = directions_;
  result.patches = patches_;
  result.channels = scene.channels();
  result.interreflected = shares.all > 0 ? shares.interreflected / shares.all : 0;
  for (std::size_t k = 0; k < scene.options.distant_cells.size(); ++k)
    result.distant.push_back(shares.all > 0 ? shares.distant[k] / shares.all : 0);

  // Average the two estimates of every pair, and measure how much they differ.
  const std::size_t n = directions_;
  const std::vector<float>& z = scene.directions.z;
  const std::vector<double> correction = corrections(scene);
  result.values.resize(values_.size());
  double difference = 0, norm = 0;
  for (std::size_t plane = 0; plane < values_.size(); plane += n * n) {  // channels and patches
    for (std::size_t i = 0; i < n; ++i) {
      for (std::size_t o = 0; o < n; ++o) {
        const double a = values_[plane + i * n + o], b = values_[plane + o * n + i];
        result.values[plane + i * n + o] = static_cast<float>(0.5 * correction[i] * correction[o] * (a + b));
        if (z[i] < kGrazingCosine || z[o] < kGrazingCosine) continue;
        difference += (a - b) * (a - b), norm += (a + b) * (a + b);
      }
    }
  }
  result.asymmetry = norm > 0 ? std::sqrt(difference / norm) : 0;
  return result;
}

}  // namespace glint::bake
