// Effective BRDFs against a path tracer that shares nothing with the estimators (support/path_tracer.h).

#include <gtest/gtest.h>

#include "glint/bake/displace/effective_brdf.h"
#include "support/path_tracer.h"
#include "support/test_heights.h"

namespace glint::bake {
namespace {

constexpr float kCosine70 = 0.342f;
/// The bound. The noise of the truth itself is about 0.4 %.
constexpr double kRms = 0.01;
constexpr std::size_t kWalks = 120000;

EffectiveBrdf estimated(const test::OwnedSurface& map, std::span<const Vec3> directions, const BaseBrdf& base,
                        const BaseTexture& texture) {
  const auto surface = map.surface();
  const VisibilityMasks masks(surface, directions);
  return effectiveBrdf(surface, masks, directions, {1, 1, map.width, map.height, 1}, {base, kAllBounces, 1, {}, 0, 0, texture});
}

TEST(EffectiveBrdfTruth, DiffuseInterreflectionsAgreeWithAPathTracer) {
  const auto directions = angularDirections(7);
  const BaseBrdf base{BaseBrdf::Kind::diffuse, 0.8f, 0, 1, 0};
  for (const SynthKind kind : {SynthKind::isotropic, SynthKind::weave, SynthKind::scratches, SynthKind::sawtooth}) {
    const test::OwnedSurface map = test::synthSurface(kind, 96, 64);
    const BaseTexture plain;
    const EffectiveBrdf fast = estimated(map, directions, base, plain);
    const auto truth = test::PathTracer(map.surface(), base, plain, directions, kWalks).diffuse();
    const double rms = test::rmsWithin70Degrees(fast.patch(0), truth, directions);
    EXPECT_LT(rms, kRms) << static_cast<int>(kind);
    RecordProperty("rms_" + std::to_string(static_cast<int>(kind)), std::to_string(rms));
  }
}

TEST(EffectiveBrdfTruth, ASawtoothWithTwoColoursAgreesWithAPathTracer) {
  const auto directions = angularDirections(7);
  const std::size_t pairs = directions.size() * directions.size();
  const BaseBrdf base{BaseBrdf::Kind::diffuse, 0.9f, 0, 1, 0};
  // Steep grooves show what one bit of visibility for a facet costs where colours end in a valley: 0.2 to 1 %.
  const std::pair<const char*, test::OwnedSurface> maps[] = {{"sawtooth", test::synthSurface(SynthKind::sawtooth, 96, 64)},
                                                             {"grooves", test::grooves(96, 64, 24, 1)}};
  for (const auto& [name, map] : maps) {
    const BaseTexture texture = test::twoColors(map);
    const EffectiveBrdf fast = estimated(map, directions, base, texture);
    const auto truth = test::PathTracer(map.surface(), base, texture, directions, kWalks).diffuse();
    for (std::size_t c = 0; c < 3; ++c) {
      const double rms = test::rmsWithin70Degrees(fast.patch(0, c), std::span(truth).subspan(c * pairs, pairs), directions);
      EXPECT_LT(rms, kRms) << name << " " << c;
      RecordProperty(std::string("rms_") + name + std::to_string(c), std::to_string(rms));
    }
  }
}

/// Norm of the difference over the norm of the truth, three views, lights within 70 degrees, all channels.
double glossyError(const test::OwnedSurface& map, const BaseBrdf& base, const BaseTexture& texture) {
  const auto directions = angularDirections(5);
  const std::size_t n = directions.size();
  const EffectiveBrdf fast = estimated(map, directions, base, texture);
  const test::PathTracer tracer(map.surface(), base, texture, directions, kWalks);
  double difference = 0, norm = 0;
  for (const std::size_t view : {12u, 6u, 8u}) {
    const std::vector<double> truth = tracer.view(view);
    for (std::size_t c = 0; c < fast.channels; ++c) {
      for (std::size_t i = 0; i < n; ++i) {
        if (directions[i].z < kCosine70) continue;
        const double d = fast.patch(0, c)[i * n + view] - truth[c * n + i];
        difference += d * d, norm += truth[c * n + i] * truth[c * n + i];
      }
    }
  }
  EXPECT_GT(fast.interreflected, 0.02);
  return std::sqrt(difference / norm);
}

TEST(EffectiveBrdfTruth, GlossyInterreflectionsAgreeWithAPathTracer) {
  const BaseBrdf base{BaseBrdf::Kind::ggx, 1, 0.5f, 0.2f, 3.9f};
  for (const SynthKind kind : {SynthKind::isotropic, SynthKind::weave}) {
    const double error = glossyError(test::synthSurface(kind, 96, 64), base, {});
    EXPECT_LT(error, kRms) << static_cast<int>(kind);
    RecordProperty("rms_" + std::to_string(static_cast<int>(kind)), std::to_string(error));
  }
}

TEST(EffectiveBrdfTruth, GlossyColoursAndRoughnessAgreeWithAPathTracer) {
  const BaseBrdf base{BaseBrdf::Kind::ggx, 1, 0.6f, 1, 0};
  const test::OwnedSurface map = test::grooves(96, 64, 12, 1);
  BaseTexture texture = test::twoColors(map);
  for (std::size_t k = 0; k < map.heights.size(); ++k) texture.roughness.push_back(texture.colors[3 * k] > 0.5f ? 1.0f : 0.75f);
  const double error = glossyError(map, base, texture);
  EXPECT_LT(error, kRms);
  RecordProperty("rms", std::to_string(error));
}

}  // namespace
}  // namespace glint::bake
