// Footprints of a few texels, answered from the texels: times and errors of ManifoldNdf beside Reference, in one run.
//   glint-near-bench NORMALS.glint... [--sigma-r .005] [--queries 400]
// Prints JSON. For each map, surface, shape and size of footprint and question: microseconds a query of both, and the error of
// ManifoldNdf, the root mean square of its difference from Reference over that of the answer. Questions: `random`, towards normals of
// random texels; `own`, towards half vectors that are drawn from the footprint; `sample` draws them; `mean`, over boxes of .1 around
// normals of random texels. Times are of one thread. Shapes: `round` (sizes are deviations), `box` (turned boxes of the same moments).

#include <time.h>

#include <CLI/CLI.hpp>
#include <algorithm>
#include <cmath>
#include <iostream>
#include <nlohmann/json.hpp>
#include <random>
#include <string>
#include <vector>

#include "glint/formats/asset_reader.h"
#include "glint/query/manifold_ndf.h"
#include "glint/query/reference.h"

namespace {

using namespace glint;
using nlohmann::ordered_json;

constexpr float kSigmas[] = {0.5f, 1, 2, 4, 8};
constexpr float kHalfRange = 0.05f;

struct Question {
  Footprint footprint;
  Vec2 half;
  Vec2 xi;
  Box2 range() const { return {half - Vec2{kHalfRange, kHalfRange}, half + Vec2{kHalfRange, kHalfRange}}; }
};

double threadSeconds() {
  timespec t;
  clock_gettime(CLOCK_THREAD_CPUTIME_ID, &t);
  return static_cast<double>(t.tv_sec) + 1e-9 * static_cast<double>(t.tv_nsec);
}

/// Microseconds a question of `ask`, over the first `count` questions; answers are kept.
template <class Ask>
double microseconds(const std::vector<Question>& questions, std::size_t count, std::vector<double>& answers, const Ask& ask) {
  answers.clear();
  const double begin = threadSeconds();
  for (std::size_t k = 0; k < count; ++k) answers.push_back(double{ask(questions[k])});
  return 1e6 * (threadSeconds() - begin) / static_cast<double>(count);
}

/// Questions that Reference answers too: it takes milliseconds for a large footprint, and for a mean.
std::size_t slowCount(float sigma, bool mean) { return mean ? (sigma < 2 ? 30 : 10) : sigma < 4 ? 100 : 30; }

ordered_json compare(const std::vector<Question>& questions, std::size_t slow_count, const auto& fast, const auto& slow) {
  std::vector<double> answers, expected;
  const double fast_us = microseconds(questions, questions.size(), answers, fast);
  const double slow_us = microseconds(questions, std::min(slow_count, questions.size()), expected, slow);
  double difference = 0, truth = 0;
  for (std::size_t k = 0; k < expected.size(); ++k) {
    difference += (answers[k] - expected[k]) * (answers[k] - expected[k]);
    truth += expected[k] * expected[k];
  }
  return {{"us", fast_us}, {"reference_us", slow_us}, {"error", std::sqrt(difference / truth)}};
}

/// A round footprint, or a turned box with the moments of the round one.
Footprint footprintOf(bool box, Vec2 centre, float sigma, float angle) {
  if (!box) return Footprint::isotropic(centre, sigma);
  const Vec2 side = std::sqrt(3.0f) * sigma * Vec2{std::cos(angle), std::sin(angle)};
  return Footprint::box(centre, side, {-side.y, side.x});
}

/// Adds the figures of one surface and shape of footprint.
void measure(const std::string& name, const NormalMap& map, float sigma_r, std::size_t count, Surface surface, bool box,
             ordered_json& results) {
  const ManifoldNdf fast(map, sigma_r, surface);
  const Reference slow(map, sigma_r, surface, Boundary::wrap, Reference::Search::pruned);
  for (const float sigma : kSigmas) {
    std::mt19937 random(1);
    const auto unit = [&] { return static_cast<float>(random() >> 8) * 0x1p-24f; };
    std::vector<Question> anywhere(count), own;
    for (Question& q : anywhere) {
      const float u = unit(), v = unit(), angle = 2 * kPi * unit();
      q.footprint = footprintOf(box, {u, v}, sigma, angle);
      q.half = map.normals[random() % map.normals.size()];
      q.xi.x = unit();
      q.xi.y = unit();
    }
    own = anywhere;
    for (Question& q : own) q.half = fast.sample(q.footprint, q.xi).h;
    const auto density = [](const auto& ndf) { return [&](const Question& q) { return ndf.density(q.footprint, q.half); }; };
    const auto sample = [](const auto& ndf) { return [&](const Question& q) { return ndf.sample(q.footprint, q.xi).pdf; }; };
    const auto mean = [](const auto& ndf) { return [&](const Question& q) { return ndf.mean(q.footprint, q.range()); }; };
    ordered_json entry = {{"map", name},
                          {"surface", surface == Surface::flat ? "flat" : "smooth"},
                          {"shape", box ? "box" : "round"},
                          {"sigma_texels", sigma}};
    entry["random"] = compare(anywhere, slowCount(sigma, false), density(fast), density(slow));
    entry["own"] = compare(own, slowCount(sigma, false), density(fast), density(slow));
    entry["sample"] = compare(anywhere, slowCount(sigma, false), sample(fast), sample(slow));
    entry["mean"] = compare(anywhere, slowCount(sigma, true), mean(fast), mean(slow));
    results.push_back(std::move(entry));
  }
}

}  // namespace

int main(int argc, char** argv) {
  CLI::App app("Times and errors of footprints of a few texels");
  std::vector<std::string> paths;
  float sigma_r = 0.005f;
  std::size_t queries = 400;
  app.add_option("NORMALS", paths, "assets of kind normals")->required()->check(CLI::ExistingFile);
  app.add_option("--sigma-r", sigma_r, "roughness of facets");
  app.add_option("--queries", queries, "of each size and question");
  CLI11_PARSE(app, argc, argv);
  ordered_json results = ordered_json::array();
  for (const std::string& path : paths) {
    const formats::Asset asset = formats::Asset::open(path);
    const std::string name = path.substr(path.find_last_of('/') + 1);
    for (const Surface surface : {Surface::smooth, Surface::flat})
      for (const bool box : {false, true}) measure(name, asset.get<NormalMap>(), sigma_r, queries, surface, box, results);
  }
  std::cout << results.dump(1) << '\n';
}
