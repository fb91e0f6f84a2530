// Noise and reciprocity of glossy effective BRDFs at the sizes that the targets are for.

#include <gtest/gtest.h>

#include <cmath>

#include "glint/bake/displace/effective_brdf.h"
#include "support/test_heights.h"

namespace glint::bake {
namespace {

constexpr float kCosine70 = 0.342f;
/// The bounds: of each entry within 70 degrees, and of both ways of a pair within 75.
constexpr double kNoise = 0.01;
constexpr double kReciprocity = 0.005;

class GlossyNoise : public testing::TestWithParam<float> {};

TEST_P(GlossyNoise, IsBelowOnePercentOfEachEntry) {
  const auto directions = angularDirections(15);
  const test::OwnedSurface map = test::synthSurface(SynthKind::isotropic, 1024, 1024);
  const auto surface = map.surface();
  const VisibilityMasks masks(surface, directions);
  const std::size_t n = directions.size();
  EffectiveBrdf runs[2];
  for (const std::uint64_t seed : {0u, 1u}) {
    const EffectiveOptions options{{BaseBrdf::Kind::ggx, 1, GetParam(), 1, 0}, kAllBounces, seed + 1, {}, 0, 0, {}};
    runs[seed] = effectiveBrdf(surface, masks, directions, {1, 1, 1024, 1024, 1}, options);
  }
  double squares = 0, count = 0;
  for (std::size_t i = 0; i < n; ++i) {
    for (std::size_t o = 0; o < n; ++o) {
      if (directions[i].z < kCosine70 || directions[o].z < kCosine70) continue;
      const double relative = runs[0].values[i * n + o] / runs[1].values[i * n + o] - 1;
      squares += relative * relative, ++count;
    }
  }
  const double noise = std::sqrt(squares / count / 2);
  RecordProperty("noise", std::to_string(noise));
  RecordProperty("asymmetry", std::to_string(runs[0].asymmetry));
  EXPECT_LT(noise, kNoise);
  EXPECT_GT(noise, 0);
  EXPECT_LT(runs[0].asymmetry, kReciprocity);
}

INSTANTIATE_TEST_SUITE_P(Alphas, GlossyNoise, testing::Values(0.1f, 0.3f),
                         [](const auto& test) { return test.param < 0.2f ? "Narrow" : "Broad"; });

}  // namespace
}  // namespace glint::bake
