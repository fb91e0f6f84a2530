// Footprints of a few texels, answered from the texels: times and errors of ManifoldNdf beside Reference, in one run.
//   glint-near-bench NORMALS.glint... [--sigma-r .005] [--queries 400]
// One line for each map, size of footprint and question: microseconds a query of both, how many times as fast, and the error of
// ManifoldNdf: root mean square of its difference from Reference over that of the answer. `random`: half vectors are normals of random
// texels. `own`: half vectors are drawn from the footprint. `sample` and `mean` ask in the same places, `mean` over boxes of .1.

#include <time.h>

#include <CLI/CLI.hpp>
#include <cmath>
#include <cstdio>
#include <random>
#include <string>
#include <vector>

#include "glint/formats/asset_reader.h"
#include "glint/query/manifold_ndf.h"
#include "glint/query/reference.h"

namespace {

using namespace glint;

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

void compare(const char* map, float sigma, const char* what, const std::vector<Question>& questions, std::size_t slow_count,
             const auto& fast, const auto& slow) {
  std::vector<double> answers, expected;
  const double fast_us = microseconds(questions, questions.size(), answers, fast);
  const double slow_us = microseconds(questions, std::min(slow_count, questions.size()), expected, slow);
  double difference = 0, truth = 0;
  for (std::size_t k = 0; k < expected.size(); ++k) {
    difference += (answers[k] - expected[k]) * (answers[k] - expected[k]);
    truth += expected[k] * expected[k];
  }
  std::printf("%-24s sigma %4g %-7s %9.2f us, Reference %11.2f us, %7.1f times as fast, error %.1e\n", map, double{sigma}, what,
              fast_us, slow_us, slow_us / fast_us, std::sqrt(difference / truth));
}

void measure(const char* name, const NormalMap& map, float sigma_r, std::size_t count) {
  const ManifoldNdf fast(map, sigma_r, Surface::smooth);
  const Reference slow(map, sigma_r, Surface::smooth, Boundary::wrap, Reference::Search::pruned);
  for (const float sigma : kSigmas) {
    std::mt19937 random(1);
    const auto unit = [&] { return static_cast<float>(random() >> 8) * 0x1p-24f; };
    std::vector<Question> anywhere(count), own;
    for (Question& q : anywhere) {
      const float u = unit(), v = unit();
      q.footprint = Footprint::isotropic({u, v}, sigma);
      q.half = map.normals[random() % map.normals.size()];
      q.xi.x = unit();
      q.xi.y = unit();
    }
    own = anywhere;
    for (Question& q : own) q.half = fast.sample(q.footprint, q.xi).h;
    const auto slow_count = static_cast<std::size_t>(sigma < 4 ? 100 : 30);
    const auto density = [](const auto& ndf) { return [&](const Question& q) { return ndf.density(q.footprint, q.half); }; };
    const auto sample = [](const auto& ndf) { return [&](const Question& q) { return ndf.sample(q.footprint, q.xi).pdf; }; };
    const auto mean = [](const auto& ndf) { return [&](const Question& q) { return ndf.mean(q.footprint, q.range()); }; };
    compare(name, sigma, "random", anywhere, slow_count, density(fast), density(slow));
    compare(name, sigma, "own", own, slow_count, density(fast), density(slow));
    compare(name, sigma, "sample", anywhere, slow_count, sample(fast), sample(slow));
    compare(name, sigma, "mean", anywhere, sigma < 2 ? 10 : 2, mean(fast), mean(slow));
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
  for (const std::string& path : paths) {
    const formats::Asset asset = formats::Asset::open(path);
    measure(path.substr(path.find_last_of('/') + 1).c_str(), asset.get<NormalMap>(), sigma_r, queries);
  }
}
