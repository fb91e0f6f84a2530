// Light integrals by spherical harmonics against quadrature, and against Monte Carlo at equal error:
//   glint-sh-bench [--quick] [--band-limit]
// --band-limit: only what the band limit of the footprint's normals saves. Prints one JSON object. Errors are RMS over
// outgoing directions and colours, relative to the RMS of the truth. Times are thread CPU time, medians.

#include <time.h>

#include <algorithm>
#include <cmath>
#include <cstdio>
#include <cstring>
#include <nlohmann/json.hpp>
#include <random>
#include <string>
#include <vector>

#include "glint/bake/sh/light.h"
#include "glint/bake/sh/lobes.h"
#include "glint/query/light/sh_light_query.h"
#include "glint/query/light/sh_lobe_table.h"
#include "support/light_reference.h"

namespace {

using namespace glint;
using nlohmann::json;
using test::FixedHistogram;
using test::TestLight;

constexpr double kPi = std::numbers::pi;
constexpr int kEnvironmentHeight = 128;
const Footprint kFootprint = Footprint::isotropic({0.5f, 0.5f}, 8);
const std::pair<const char*, TestLight> kLights[] = {
    {"constant", TestLight::constant}, {"bright_spot", TestLight::bright_spot}, {"studio", TestLight::studio}};

double cpuSeconds() {
  timespec now;
  clock_gettime(CLOCK_THREAD_CPUTIME_ID, &now);
  return static_cast<double>(now.tv_sec) + 1e-9 * static_cast<double>(now.tv_nsec);
}

/// Median seconds of one call, of seven runs.
template <class Call>
double secondsOf(int calls, Call&& call) {
  std::vector<double> runs;
  for (int run = 0; run < 7; ++run) {
    const double start = cpuSeconds();
    for (int k = 0; k < calls; ++k) call(k);
    runs.push_back((cpuSeconds() - start) / calls);
  }
  std::nth_element(runs.begin(), runs.begin() + 3, runs.end());
  return runs[3];
}

FixedHistogram randomHistogram(int bins) {
  FixedHistogram histogram;
  std::mt19937 random(11);
  std::normal_distribution<float> slope(0, 0.25f);
  for (int k = 0; k < bins; ++k) {
    const float x = slope(random), y = slope(random), scale = 1 / std::sqrt(1 + x * x + y * y);
    histogram.normals.push_back({scale * x, scale * y});
    histogram.weights.push_back(1.0f / static_cast<float>(bins));
  }
  return histogram;
}

/// A Gaussian of normals without gaps.
FixedHistogram smoothHistogram(float deviation) {
  FixedHistogram histogram;
  constexpr float kStep = 0.04f;
  const float reach = std::min(0.85f, 5 * deviation);
  float total = 0;
  for (float y = -reach; y <= reach; y += kStep) {
    for (float x = -reach; x <= reach; x += kStep) {
      if (x * x + y * y > reach * reach) continue;
      histogram.normals.push_back({x, y});
      histogram.weights.push_back(std::exp(-0.5f * (x * x + y * y) / (deviation * deviation)));
      total += histogram.weights.back();
    }
  }
  for (float& w : histogram.weights) w /= total;
  return histogram;
}

std::vector<Vec3> outgoingDirections() {
  std::vector<Vec3> directions;
  for (const double theta : {0.07, 0.35, 0.7, 1.0}) {
    for (const double phi : {0.31, 1.9, 3.3, 5.2})
      directions.push_back({static_cast<float>(std::sin(theta) * std::cos(phi)),
                            static_cast<float>(std::sin(theta) * std::sin(phi)), static_cast<float>(std::cos(theta))});
  }
  return directions;
}

/// One light, lobe and histogram, with the truth.
struct Case {
  bake::Environment environment;
  FixedHistogram histogram = randomHistogram(24);
  float sigma_r;
  std::vector<Vec3> directions = outgoingDirections();
  std::vector<std::vector<double>> truth;

  Case(TestLight light, float sigma) : environment(test::testEnvironment(light, kEnvironmentHeight)), sigma_r(sigma) {
    for (const Vec3 wo : directions) truth.push_back(test::lightIntegralByQuadrature(environment, histogram, sigma, wo, 80));
  }
  /// RMS of error(direction, colour) relative to the truth.
  template <class Answer>
  double relativeError(Answer&& answer) const {
    double error = 0, norm = 0;
    for (std::size_t d = 0; d < directions.size(); ++d) {
      const ShLightIntegral a = answer(directions[d]);
      for (std::size_t c = 0; c < 3; ++c) error += std::pow(a.value[c] - truth[d][c], 2), norm += truth[d][c] * truth[d][c];
    }
    return std::sqrt(error / norm);
  }
};

class Query {
 public:
  Query(const bake::ShLightData& light, float sigma_r) : light_(light.view()), sigma_r_(sigma_r) {
    const std::vector<double> f = bake::zonalLobe(sigma_r, light_.order);
    zonal_.assign(f.begin(), f.end());
    memory_.resize(ShRecurrence<float>::size(light_.order));
    recurrence_ = ShRecurrence<float>(light_.order, memory_);
    scratch_.resize(ShLightQuery<float>::scratchSize(light_.order));
  }
  ShLightIntegral operator()(const FixedHistogram& histogram, Vec3 wo, const ShLightOptions& options) {
    return ShLightQuery<float>(light_, zonal_, recurrence_, sigma_r_)
        .integral(histogram, kFootprint, {}, wo, options, scratch_);
  }

 private:
  ShLight light_;
  float sigma_r_;
  std::vector<float> zonal_, memory_, scratch_;
  ShRecurrence<float> recurrence_;
};

/// Monte Carlo with samples of the NDF: a bin by its weight, a half vector by the lobe.
class MonteCarlo {
 public:
  explicit MonteCarlo(const Case& c) : c_(c) {
    for (std::size_t k = 0; k < c.histogram.normals.size(); ++k) {
      const Vec2 n = c.histogram.normals[k];
      total_ += c.histogram.weights[k] / std::sqrt(1 - dot(n, n));
      cumulative_.push_back(total_);
    }
  }
  /// One sample of the green integral.
  double sample(Vec3 wo) {
    const float chosen = unit() * total_;
    const std::size_t k = std::min<std::size_t>(
        std::lower_bound(cumulative_.begin(), cumulative_.end(), chosen) - cumulative_.begin(), cumulative_.size() - 1);
    const Vec2 n = c_.histogram.normals[k];
    const Vec3 m = {n.x, n.y, std::sqrt(1 - dot(n, n))};
    const Vec3 u = test::unit({m.z, 0, -m.x}), v = {m.y * u.z - m.z * u.y, m.z * u.x - m.x * u.z, m.x * u.y - m.y * u.x};
    const float sine2 = -2 * c_.sigma_r * c_.sigma_r * std::log(1 - unit()), phi = 2 * std::numbers::pi_v<float> * unit();
    if (sine2 >= 1) return 0;
    const float sine = std::sqrt(sine2), cosine = std::sqrt(1 - sine2);
    const Vec3 h = cosine * m + sine * std::cos(phi) * u + sine * std::sin(phi) * v;
    const float ho = dot(h, wo);
    const Vec3 wi = 2 * ho * h - wo;
    return ho > 0 && wi.z > 0 ? double{total_} * 4 * ho / cosine * c_.environment.at(wi)[1] : 0;
  }

 private:
  float unit() { return static_cast<float>(random_() >> 8) * 0x1p-24f; }
  const Case& c_;
  std::vector<float> cumulative_;
  float total_ = 0;
  std::mt19937 random_{1};
};

json errorsByOrder(bool quick) {
  json rows = json::array();
  const int highest = quick ? 40 : 100;
  for (const auto& [name, light] : kLights) {
    const bake::ShLightData table =
        bake::buildShLight(test::testEnvironment(light, kEnvironmentHeight), {.order = highest, .grid = {17, 32}});
    for (const float sigma : {0.02f, 0.05f, 0.1f}) {
      const Case c(light, sigma);
      Query query(table, sigma);
      for (const int order : {0, 1, 5, 10, 20, 30, 40, 60, 100}) {
        if (order > highest) continue;
        json row = {{"light", name}, {"sigma_r", sigma}, {"order", order}};
        for (const auto& [window, word] :
             {std::pair{ShWindow::none, "none"}, {ShWindow::lanczos, "lanczos"}, {ShWindow::hann, "hann"}})
          row[word] = c.relativeError([&](Vec3 wo) { return query(c.histogram, wo, {.order = order, .window = window}); });
        rows.push_back(row);
      }
    }
  }
  return rows;
}

json errorsByGrid(bool quick) {
  json rows = json::array();
  const Case c(TestLight::studio, 0.05f);
  for (const ShGrid grid : {ShGrid{9, 16}, {17, 32}, {33, 64}}) {
    if (quick && grid.rows > 17) continue;
    for (const ShPrecision precision : {ShPrecision::f16, ShPrecision::f32}) {
      const bake::ShLightData table = bake::buildShLight(c.environment, {.order = 60, .grid = grid, .precision = precision});
      Query query(table, 0.05f);
      const double bytes =
          3.0 * static_cast<double>(grid.directionCount() * shCount(60)) * (precision == ShPrecision::f16 ? 2 : 4);
      rows.push_back({{"grid", std::to_string(grid.rows) + "x" + std::to_string(grid.columns)},
                      {"precision", precision == ShPrecision::f16 ? "f16" : "f32"},
                      {"megabytes", bytes / 1e6},
                      {"blended", c.relativeError([&](Vec3 wo) { return query(c.histogram, wo, {}); })},
                      {"nearest", c.relativeError([&](Vec3 wo) { return query(c.histogram, wo, {.nearest = true}); })}});
    }
  }
  return rows;
}

/// Cost against error as bands are left out that the footprint's own normals do not have (Gamboa 2018, section 4.2): three
/// footprints, from glints to a smooth pixel.
json timesByBandLimit(bool quick) {
  constexpr float kSigma = 0.05f;
  const int order = quick ? 30 : 60;
  const bake::ShLightData table =
      bake::buildShLight(test::testEnvironment(TestLight::studio, kEnvironmentHeight), {.order = order, .grid = {9, 16}});
  Query query(table, kSigma);
  json rows = json::array();
  const std::vector<Vec3> directions = outgoingDirections();
  for (const auto& [name, histogram] : {std::pair{"24 facets", randomHistogram(24)},
                                        {"288 facets", randomHistogram(288)},
                                        {"smooth, 0.15", smoothHistogram(0.15f)},
                                        {"smooth, 0.25", smoothHistogram(0.25f)}}) {
    for (const float epsilon : {0.0f, 1e-6f, 1e-4f, 1e-2f}) {
      double error = 0, norm = 0, bands = 0;
      for (const Vec3 wo : directions) {
        const ShLightIntegral whole = query(histogram, wo, {}), part = query(histogram, wo, {.ndf_epsilon = epsilon});
        for (int c = 0; c < 3; ++c)
          error += std::pow(part.signed_value[c] - whole.signed_value[c], 2), norm += std::pow(whole.signed_value[c], 2);
        bands += part.order / static_cast<double>(directions.size());
      }
      volatile float sink = 0;
      const double seconds = secondsOf(32, [&](int k) {
        sink = query(histogram, directions[static_cast<std::size_t>(k) % 16], {.ndf_epsilon = epsilon}).value[1];
      });
      rows.push_back({{"footprint", name},
                      {"bins", histogram.normals.size()},
                      {"epsilon", epsilon},
                      {"bands", bands},
                      {"us", 1e6 * seconds},
                      {"error", std::sqrt(error / norm)}});
    }
  }
  return rows;
}

/// Microseconds of summing turned lobes, exactly and from the table.
json lobeTimes(int order) {
  const bake::ShLobesData lobes = bake::buildShLobes({.sigma_r = 0.05f, .order = order, .grid = {65, 128}});
  const FixedHistogram histogram = randomHistogram(1000);
  std::vector<float> out(shCount(order)), memory(ShRecurrence<float>::size(order)),
      scratch(ShAccumulator<float>::scratchSize(order));
  const ShRecurrence<float> recurrence(order, memory);
  const auto direction = [&](int k) {
    const Vec2 n = histogram.normals[static_cast<std::size_t>(k) % 1000];
    return Vec3{n.x, n.y, std::sqrt(1 - dot(n, n))};
  };
  ShAccumulator<float> sum(recurrence, order, out, scratch);
  const double exact = secondsOf(1000, [&](int k) { sum.add(direction(k), 1); });
  const ShLobeTable table(lobes.view());
  const double tabulated = secondsOf(1000, [&](int k) { table.add(direction(k), 1, order, out); });
  return {{"turned_us_per_lobe", 1e6 * exact}, {"table_us_per_lobe", 1e6 * tabulated}};
}

json timesAtEqualError(bool quick) {
  json rows = json::array();
  for (const auto& [name, light] : kLights) {
    const Case c(light, 0.05f);
    MonteCarlo monte_carlo(c);
    double variance = 0, norm = 0;
    for (std::size_t d = 0; d < c.directions.size(); ++d) {
      constexpr int kSamples = 20000;
      double sum = 0, squares = 0;
      for (int k = 0; k < kSamples; ++k) {
        const double v = monte_carlo.sample(c.directions[d]);
        sum += v, squares += v * v;
      }
      variance += squares / kSamples - sum / kSamples * sum / kSamples;
      norm += c.truth[d][1] * c.truth[d][1];
    }
    volatile double sink = 0;
    const double sample_seconds =
        secondsOf(20000, [&](int k) { sink = monte_carlo.sample(c.directions[static_cast<std::size_t>(k) % 16]); });
    for (const int order : {30, 60, 100}) {
      if (quick && order > 30) continue;
      const bake::ShLightData table = bake::buildShLight(c.environment, {.order = order, .grid = {9, 16}});
      Query query(table, c.sigma_r);
      json row = {{"light", name},
                  {"order", order},
                  {"bins", c.histogram.normals.size()},
                  {"monte_carlo_ns_per_sample", 1e9 * sample_seconds}};
      for (const bool nearest : {true, false}) {
        const ShLightOptions options = {.nearest = nearest};
        const double error = c.relativeError([&](Vec3 wo) { return query(c.histogram, wo, options); });
        const double seconds = secondsOf(
            64, [&](int k) { sink = query(c.histogram, c.directions[static_cast<std::size_t>(k) % 16], options).value[1]; });
        const double samples = variance / norm / (error * error);
        row[nearest ? "nearest" : "blended"] = {{"error", error},
                                                {"us", 1e6 * seconds},
                                                {"monte_carlo_samples", samples},
                                                {"monte_carlo_us", 1e6 * samples * sample_seconds}};
      }
      rows.push_back(row);
    }
  }
  return rows;
}

}  // namespace

int main(int argc, char** argv) {
  const auto given = [&](const char* flag) {
    return std::any_of(argv + 1, argv + argc, [&](const char* argument) { return std::strcmp(argument, flag) == 0; });
  };
  const bool quick = given("--quick");
  if (given("--band-limit")) {
    std::printf("%s\n", timesByBandLimit(quick).dump(1).c_str());
    return 0;
  }
  const json result = {{"errors_by_order", errorsByOrder(quick)},
                       {"errors_by_grid", errorsByGrid(quick)},
                       {"times_at_equal_error", timesAtEqualError(quick)},
                       {"times_by_band_limit", timesByBandLimit(quick)},
                       {"lobe_times", {{"30", lobeTimes(30)}, {"60", lobeTimes(60)}}}};
  std::printf("%s\n", result.dump(1).c_str());
}
