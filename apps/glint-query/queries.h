#pragma once

#include <algorithm>
#include <chrono>
#include <nlohmann/json.hpp>
#include <optional>
#include <span>
#include <string>
#include <utility>
#include <vector>

#include "common/ndf_models.h"
#include "common/tool.h"
#include "glint-query/csv_table.h"
#include "glint/model/footprint.h"

namespace glint::apps {

/// A question at a footprint: the density towards a half vector, or its mean over a box of half vectors.
struct Query {
  Footprint footprint;
  double u = 0, v = 0;  ///< centre of the footprint, in maps; on a plane without end the whole part counts
  std::optional<Vec2> half;
  std::optional<Box2> range;
  Vec2 spread;  ///< on a curved surface: half widths of the box of half vectors that the pixel sees
};

/// Answer of a model to one query.
float answer(const AnyNdf& model, const Query& query);

/// Answers to many queries, in their order; parallel.
std::vector<float> answerAll(const AnyNdf& model, std::span<const Query> queries);

/// Median nanoseconds of a query over `repeats` runs of one thread.
/// @param ask  asks once
template <class Ask>
double medianNanoseconds(int repeats, const Ask& ask) {
  // Each run asks several times, so that the time of reading the clock is negligible.
  constexpr int kRuns = 15;
  const int per_run = std::max(1, repeats / kRuns);
  std::vector<double> times;
  volatile float sink = 0;
  for (int run = 0; run < kRuns; ++run) {
    const auto start = std::chrono::steady_clock::now();
    for (int k = 0; k < per_run; ++k) sink = ask();
    times.push_back(std::chrono::duration<double, std::nano>(std::chrono::steady_clock::now() - start).count() / per_run);
  }
  static_cast<void>(sink);
  std::nth_element(times.begin(), times.begin() + kRuns / 2, times.end());
  return times[kRuns / 2];
}

/// Sets the result of one query, and prints the time that it took, where there is one.
void setResult(Tool& tool, nlohmann::json result, std::optional<double> nanoseconds);

/// Sets the result of one query. With repeats, measures the time of the query, prints it and adds it to the result.
/// @param ask  asks once
template <class Ask>
void reportTimed(Tool& tool, const nlohmann::json& result, int repeats, const Ask& ask) {
  setResult(tool, result, repeats > 0 ? std::optional(medianNanoseconds(repeats, ask)) : std::nullopt);
}

/// A table of queries: the header names columns u, v; sigma or sxx, sxy, syy or ax, ay, bx, by; hx, hy or x0, y0, x1, y1;
/// and may name spread_x, spread_y. Further columns are kept.
class QueryTable {
 public:
  /// @throws Error io; invalid_input that names the row, by the rules of the options
  static QueryTable read(const std::string& path);

  const std::vector<Query>& queries() const { return queries_; }

  /// The table with one more column: `density` or `mean`.
  std::string withAnswers(std::span<const float> answers) const;

 private:
  explicit QueryTable(CsvTable table) : table_(std::move(table)) {}

  CsvTable table_;
  std::vector<Query> queries_;
};

/// Draws half vectors from the distribution inside a footprint. The random numbers are stratified: the unit square has `count`
/// cells of equal area, and each has one pair of numbers, which depends only on the seed and the cell.
/// @param spread  as Query::spread
std::vector<HalfVectorSample> drawSamples(const AnyNdf& model, const Footprint& footprint, Vec2 spread, int count,
                                          std::uint64_t seed);

/// Samples as a CSV table with the columns hx, hy and pdf.
std::string sampleTable(std::span<const HalfVectorSample> samples);

}  // namespace glint::apps
