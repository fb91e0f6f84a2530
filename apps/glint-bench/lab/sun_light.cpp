#include "glint-bench/lab/sun_light.h"

#include <cmath>
#include <numbers>

#include "glint/bake/sh/light.h"
#include "glint/bake/sh/lobes.h"
#include "glint/query/light/sh_light_query.h"

namespace glint::apps {
namespace {

constexpr float kSunDegrees = 1.5f;

/// A surface of one facet, that faces up: the interface that ShLightQuery asks.
struct OneFacet {
  template <class Visitor>
  void forEachBin(const Footprint&, Visitor&& visitor) const {
    visitor(0, 1.0f);
  }
  Vec2 binNormal(int) const { return {}; }
};

/// Outgoing directions in the plane of the sun, from 75 degrees on its side to 75 on the other.
std::vector<Vec3> views() {
  std::vector<Vec3> directions;
  for (int degrees = -75; degrees <= 75; ++degrees) {
    const float angle = std::numbers::pi_v<float> * static_cast<float>(degrees) / 180;
    directions.push_back({-std::sin(angle), 0, std::cos(angle)});
  }
  return directions;
}

}  // namespace

bake::Environment sunLight() {
  constexpr int kHeight = 256;
  const float pi = std::numbers::pi_v<float>, theta = pi * 40 / 180;
  const Vec3 towards = {std::sin(theta), 0, std::cos(theta)};
  bake::Environment e{2 * kHeight, kHeight, {}};
  for (int j = 0; j < kHeight; ++j) {
    for (int i = 0; i < 2 * kHeight; ++i) {
      const float t = pi * (1 - (static_cast<float>(j) + 0.5f) / kHeight), p = pi * (static_cast<float>(i) + 0.5f) / kHeight;
      const Vec3 d = {std::sin(t) * std::cos(p), std::sin(t) * std::sin(p), std::cos(t)};
      const bool lit = dot(d, towards) > std::cos(pi * kSunDegrees / 180);
      e.rgb.insert(e.rgb.end(), 3, lit ? 1000.0f : 0.0f);
    }
  }
  return e;
}

std::vector<double> sunAnswers(const bake::Environment& environment, int order, ShWindow window, const ShGrid& grid) {
  bake::ShLightOptions table_options;
  table_options.order = order, table_options.grid = grid, table_options.precision = ShPrecision::f32;
  const bake::ShLightData table = bake::buildShLight(environment, table_options);
  const ShLight light = table.view();
  const std::vector<double> exact = bake::zonalLobe(kSunSigmaR, order);
  const std::vector<float> zonal(exact.begin(), exact.end());
  std::vector<float> memory(ShRecurrence<float>::size(order)), scratch(ShLightQuery<float>::scratchSize(order));
  const ShRecurrence<float> recurrence(order, memory);
  const ShLightQuery<float> query(light, zonal, recurrence, kSunSigmaR);
  glint::ShLightOptions options;
  options.order = order, options.window = window;
  std::vector<double> answers;
  for (const Vec3 wo : views()) {
    const ShLightIntegral answer = query.integral(OneFacet{}, Footprint::isotropic({0.5f, 0.5f}, 8), {}, wo, options, scratch);
    answers.push_back(double{answer.signed_value[1]});
  }
  return answers;
}

}  // namespace glint::apps
