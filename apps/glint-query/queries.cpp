#include "glint-query/queries.h"

#include <fmt/format.h>
#include <tbb/parallel_for.h>

#include <algorithm>
#include <cmath>

#include "common/answer_columns.h"
#include "glint/api/plane_position.h"
#include "glint/bake/common/counter_random.h"
#include "glint/query/curved_ndf.h"

namespace glint::apps {

float answer(const AnyNdf& model, const Query& query) {
  return query.range ? api::meanAt(model, query.u, query.v, query.footprint, *query.range, query.spread)
                     : api::densityAt(model, query.u, query.v, query.footprint, *query.half, query.spread);
}

std::vector<float> answerAll(const AnyNdf& model, std::span<const Query> queries) {
  std::vector<float> answers(queries.size());
  tbb::parallel_for(std::size_t{0}, queries.size(), [&](std::size_t k) { answers[k] = answer(model, queries[k]); });
  return answers;
}

void setResult(Tool& tool, nlohmann::json result, std::optional<double> nanoseconds) {
  if (nanoseconds) {
    result["nanoseconds"] = *nanoseconds;
    tool.print(fmt::format("{:.1f} ns per query\n", *nanoseconds));
  }
  tool.setResult(result);
}

std::vector<HalfVectorSample> drawSamples(const AnyNdf& any, const Footprint& footprint, Vec2 spread, int count,
                                          std::uint64_t seed) {
  const CurvedNdf model(any, spread);
  std::vector<HalfVectorSample> samples(static_cast<std::size_t>(count));
  const int rows = std::max(1, static_cast<int>(std::sqrt(static_cast<double>(count))));
  const auto rowBegin = [&](int row) { return static_cast<std::size_t>(count) * static_cast<std::size_t>(row) / rows; };
  tbb::parallel_for(0, rows, [&](int row) {
    const std::size_t begin = rowBegin(row), end = rowBegin(row + 1);
    for (std::size_t k = begin; k < end; ++k) {
      const Vec2 jitter = bake::randomPair(seed, 0, k);
      // The height of a row is in proportion to its number of cells.
      const double x = (static_cast<double>(k - begin) + jitter.x) / static_cast<double>(end - begin);
      const double y = (static_cast<double>(begin) + jitter.y * static_cast<double>(end - begin)) / count;
      const Vec2 xi = {static_cast<float>(x), static_cast<float>(y)};
      samples[k] = model.sample(footprint, xi);
    }
  });
  return samples;
}

std::string sampleTable(std::span<const HalfVectorSample> samples) {
  std::string text = std::string(kHalfVectorSamples) + "\n";
  for (const HalfVectorSample& s : samples) text += fmt::format("{:.9g},{:.9g},{:.9g}\n", s.h.x, s.h.y, s.pdf);
  return text;
}

}  // namespace glint::apps
