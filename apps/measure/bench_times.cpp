#include "measure/bench_times.h"

#include <algorithm>
#include <array>
#include <chrono>
#include <cmath>
#include <nlohmann/json.hpp>
#include <vector>

#include "glint/api/batch.h"
#include "glint/math/gaussian.h"
#include "measure/time_rounds.h"

namespace glint::apps {
namespace {

constexpr int kRuns = 5;
constexpr double kShortestRun_s = 0.005;
constexpr std::size_t kWarm = 16;

/// Keeps an answer, so that the compiler cannot leave out the question.
void keep(float answer) { asm volatile("" : : "x"(answer) : "memory"); }

double wallSeconds() { return std::chrono::duration<double>(std::chrono::steady_clock::now().time_since_epoch()).count(); }

/// Times ask(k) for k < count. Runs of slow questions end early, those of quick ones go round.
template <class Ask>
nlohmann::json timeOf(std::size_t count, double longest_s, const Ask& ask) {
  std::array<double, kRuns> ns{};
  std::size_t next = 0;
  for (int run = -1; run < kRuns; ++run) {  // the first warms up
    const double seconds = runOf(count, next, kShortestRun_s, longest_s, ask, wallSeconds);
    if (run >= 0) ns[static_cast<std::size_t>(run)] = 1e9 * seconds;
  }
  std::sort(ns.begin(), ns.end());
  return {{"ns", ns[kRuns / 2]}, {"spread", ns.back() / ns.front()}};
}

/// The density of all questions in one call.
nlohmann::json batchTime(const api::OpenedNdf& ndf, std::span<const BenchQuery> queries, double longest_s) {
  constexpr std::size_t kBatch = 1024;
  const std::size_t count = std::min(kBatch, queries.size());
  std::vector<float> u, v, sigma, x, y, out(count);
  for (const BenchQuery& q : queries.first(count)) {
    u.push_back(q.footprint.centre.x), v.push_back(q.footprint.centre.y);
    sigma.push_back(std::sqrt(q.footprint.covariance.xx));
    x.push_back(q.half.x), y.push_back(q.half.y);
  }
  api::FootprintArrays footprints;
  footprints.u.data = u.data(), footprints.v.data = v.data(), footprints.sigma.data = sigma.data();
  api::HalfVectorArrays halves;
  halves.x.data = x.data(), halves.y.data = y.data();
  // Pieces, so that slow models end in time.
  constexpr std::size_t kPiece = 64;
  const std::size_t pieces = std::max<std::size_t>(1, count / kPiece);
  nlohmann::json time = timeOf(pieces, longest_s, [&](std::size_t k) {
    api::FootprintArrays some = footprints;
    api::HalfVectorArrays towards = halves;
    const std::size_t first = k * kPiece;
    some.u.data += first, some.v.data += first, some.sigma.data += first;
    towards.x.data += first, towards.y.data += first;
    api::densities(ndf.model(), std::min(kPiece, count - first), some, towards, out.data() + first);
  });
  time["ns"] = time["ns"].get<double>() / static_cast<double>(std::min(kPiece, count));
  return time;
}

}  // namespace

nlohmann::json benchTimes(const api::OpenedNdf& ndf, std::span<const BenchQuery> queries, std::span<const SizedQueries> sizes,
                          double longest_s) {
  // Times include the choice of the model, as those of the C interface do.
  const api::AnyNdf& model = ndf.model();
  nlohmann::json times;
  const auto density = [&](std::size_t k) { keep(model.density(queries[k].footprint, queries[k].half)); };
  times["density"]["cold"] = timeOf(queries.size(), longest_s, density);
  times["density"]["warm"] = timeOf(std::min(kWarm, queries.size()), longest_s, density);
  times["density"]["sizes"] = nlohmann::json::array();
  for (const SizedQueries& of_size : sizes) {
    nlohmann::json time = timeOf(of_size.queries.size(), longest_s, [&](std::size_t k) {
      keep(model.density(of_size.queries[k].footprint, of_size.queries[k].half));
    });
    time["sigma_texels"] = of_size.sigma_texels;
    times["density"]["sizes"].push_back(std::move(time));
  }
  times["mean"]["cold"] =
      timeOf(queries.size(), longest_s, [&](std::size_t k) { keep(model.mean(queries[k].footprint, queries[k].range)); });
  times["sample"]["cold"] =
      timeOf(queries.size(), longest_s, [&](std::size_t k) { keep(model.sample(queries[k].footprint, queries[k].xi).pdf); });
  times["density"]["batch"] = batchTime(ndf, queries, longest_s);
  return times;
}

std::vector<double> densityTimes(std::span<const AskedNdf> ndfs, double longest_s) {
  std::vector<TimedQuestions> things;
  for (const AskedNdf& asked : ndfs) {
    things.push_back({asked.queries.size(), [&asked](std::size_t k) {
                        const BenchQuery& q = asked.queries[k];
                        keep(asked.copies[k % asked.copies.size()]->model().density(q.footprint, q.half));
                      }});
  }
  std::vector<double> ns;
  for (std::vector<double>& rounds : timeInTurns(things, {.longest_s = longest_s}))
    ns.push_back(1e9 * calmTime(std::move(rounds)));
  return ns;
}

nlohmann::json plainLobeTime(std::span<const BenchQuery> queries) {
  constexpr float kAlphaX = 0.2f, kAlphaY = 0.3f;
  constexpr double kLongest_s = 0.05;
  return timeOf(queries.size(), kLongest_s, [&](std::size_t k) {
    const Vec2 h = queries[k].half;
    const float x = h.x / kAlphaX, y = h.y / kAlphaY, s = x * x + y * y + std::max(0.0f, 1 - dot(h, h));
    keep(1 / (kPi * kAlphaX * kAlphaY * s * s));
  });
}

}  // namespace glint::apps
