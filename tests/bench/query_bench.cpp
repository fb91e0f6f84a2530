// Opening assets and asking them:
//   glint-query-bench NORMALS.glint ASSET.glint... [--benchmark_format=json ...]
// Names are WHAT/FILE. `random`: footprints of every size anywhere, towards normals of the map, so that most queries miss the
// caches on big assets. `warm`: one such query again and again. A plain microfacet model (GGX) is timed in the same run, as a
// function and as a sampler of half vectors, and ratio_* give the ratios of densities and samples to it: median of alternating
// runs. `few`: the same 64 queries again and again, which stay in the caches. `batch`: those of `random` and `few` in batches
// of 1024 and 64, for each query. ratio_batch_*: how many times as many queries a second a batch answers, medians of
// alternating runs.

#include <benchmark/benchmark.h>
#include <time.h>

#include <algorithm>
#include <cmath>
#include <filesystem>
#include <list>
#include <random>
#include <string>
#include <utility>
#include <variant>
#include <vector>

#include "glint/api/any_ndf.h"
#include "glint/api/batch.h"
#include "glint/formats/asset_reader.h"

namespace {

using namespace glint;

/// Enough that their blocks do not fit a cache of a few megabytes.
constexpr std::size_t kQueries = 1 << 15;
/// Few enough that all they read stays in the nearest caches.
constexpr std::size_t kFew = 64;
/// Queries of a wavefront that are answered at once.
constexpr std::size_t kBatch = 1024;
/// Half width of the range that `mean` is asked for: a light of about 6 degrees.
constexpr float kRangeReach = 0.05f;

struct Vector {
  float x, y, z;
};

float dot(Vector a, Vector b) { return a.x * b.x + a.y * b.y + a.z * b.z; }
Vector normalized(Vector v) {
  const float s = 1 / std::sqrt(dot(v, v));
  return {s * v.x, s * v.y, s * v.z};
}

/// What a renderer without glints does: anisotropic GGX, height-correlated Smith masking, and a conductor's Fresnel term at
/// three wavelengths.
struct PlainGgx {
  float alpha_x = 0.2f, alpha_y = 0.3f;

  float distribution(Vector h) const {
    const float x = h.x / alpha_x, y = h.y / alpha_y, s = x * x + y * y + h.z * h.z;
    return 1 / (kPi * alpha_x * alpha_y * s * s);
  }
  float lambda(Vector w) const {
    const float x = w.x * alpha_x, y = w.y * alpha_y;
    return 0.5f * (std::sqrt(1 + (x * x + y * y) / (w.z * w.z)) - 1);
  }
  static float conductor(float cosine, float eta, float k) {
    const float c2 = cosine * cosine, s2 = 1 - c2, t0 = eta * eta - k * k - s2;
    const float ab = std::sqrt(t0 * t0 + 4 * eta * eta * k * k), a = std::sqrt(0.5f * (ab + t0));
    const float t1 = ab + c2, t2 = 2 * cosine * a, rs = (t1 - t2) / (t1 + t2);
    const float t3 = c2 * ab + s2 * s2, t4 = t2 * s2;
    return 0.5f * rs * (1 + (t3 - t4) / (t3 + t4));
  }
  float evaluate(Vector wi, Vector wo) const {
    const Vector h = normalized({wi.x + wo.x, wi.y + wo.y, wi.z + wo.z});
    const float c = dot(wi, h);
    const float fresnel = conductor(c, 0.20f, 3.9f) + conductor(c, 0.92f, 2.5f) + conductor(c, 1.1f, 2.4f);
    return distribution(h) * fresnel / ((1 + lambda(wi) + lambda(wo)) * 4 * wi.z);
  }
  /// A visible normal (Heitz 2018) and its pdf.
  float sample(Vector wi, Vec2 xi) const {
    const Vector v = normalized({alpha_x * wi.x, alpha_y * wi.y, wi.z});
    const float length2 = v.x * v.x + v.y * v.y, inverse = length2 > 0 ? 1 / std::sqrt(length2) : 0;
    const Vector t1 = length2 > 0 ? Vector{-v.y * inverse, v.x * inverse, 0} : Vector{1, 0, 0};
    const Vector t2 = {-v.z * t1.y, v.z * t1.x, v.x * t1.y - v.y * t1.x};
    const float r = std::sqrt(xi.x), phi = 2 * kPi * xi.y, p1 = r * std::cos(phi), s = 0.5f * (1 + v.z);
    const float p2 = (1 - s) * std::sqrt(1 - p1 * p1) + s * r * std::sin(phi);
    const float p3 = std::sqrt(std::max(0.0f, 1 - p1 * p1 - p2 * p2));
    const Vector h = normalized({alpha_x * (p1 * t1.x + p2 * t2.x + p3 * v.x), alpha_y * (p1 * t1.y + p2 * t2.y + p3 * v.y),
                                 std::max(0.0f, p2 * t2.z + p3 * v.z)});
    return distribution(h) * std::max(0.0f, dot(wi, h)) / ((1 + lambda(wi)) * wi.z) + h.x;
  }
};

struct Query {
  Footprint footprint;
  Vec2 half;
  Box2 range;
  Vec2 xi;
  Vector wi, wo;  ///< for the plain model
};

/// Uniform over the map; sizes log-uniform from `finest` to `coarsest` texels.
std::vector<Query> randomQueries(const NormalMap& map, float finest, float coarsest) {
  std::mt19937 random(1);
  const auto unit = [&] { return static_cast<float>(random() >> 8) * 0x1p-24f; };
  std::vector<Query> queries(kQueries);
  for (Query& query : queries) {
    const float u = unit(), v = unit();
    query.footprint = Footprint::isotropic({u, v}, finest * std::pow(coarsest / finest, unit()));
    query.half = map.normals[random() % map.normals.size()];
    query.xi = {unit(), unit()};
    const float nz = std::sqrt(std::max(0.01f, 1 - glint::dot(query.half, query.half)));
    query.wi = normalized({unit() - 0.5f, unit() - 0.5f, 0.3f + unit()});
    const float along = 2 * dot(query.wi, {query.half.x, query.half.y, nz});
    query.wo = normalized({along * query.half.x - query.wi.x, along * query.half.y - query.wi.y, along * nz - query.wi.z});
    query.range = {query.half - Vec2{kRangeReach, kRangeReach}, query.half + Vec2{kRangeReach, kRangeReach}};
  }
  return queries;
}

template <class Model>
float density(const Model& model, const Query& query) {
  return model.density(query.footprint, query.half);
}
template <class Model>
float mean(const Model& model, const Query& query) {
  return model.mean(query.footprint, query.range);
}
template <class Model>
float sample(const Model& model, const Query& query) {
  const HalfVectorSample s = model.sample(query.footprint, query.xi);
  return s.pdf + s.h.x + s.h.y;
}
float plainDensity(const Query& query) { return PlainGgx().evaluate(query.wi, query.wo); }
float plainSample(const Query& query) { return PlainGgx().sample(query.wi, query.xi); }

double threadSeconds() {
  timespec t;
  clock_gettime(CLOCK_THREAD_CPUTIME_ID, &t);
  return static_cast<double>(t.tv_sec) + 1e-9 * static_cast<double>(t.tv_nsec);
}

/// Median over alternating runs of the time of `ask` over that of `plain`, on the same queries.
template <class Ask, class Plain>
void addRatio(const std::string& what, const std::string& name, const std::vector<Query>& queries, Ask ask, Plain plain) {
  for (const bool warm : {true, false}) {
    benchmark::RegisterBenchmark(
        ("ratio_" + what + (warm ? "_warm/" : "_random/") + name).c_str(),
        [&queries, ask, plain, warm](benchmark::State& state) {
          constexpr int kRuns = 31, kPerRun = 1000;
          std::vector<double> ratios;
          std::size_t next = 0;
          const auto time = [&](const auto& function, std::size_t first) {
            const double start = threadSeconds();
            for (int k = 0; k < kPerRun; ++k) benchmark::DoNotOptimize(function(queries[warm ? 0 : (first + k) % kQueries]));
            return threadSeconds() - start;
          };
          for (auto _ : state) {
            for (int run = 0; run < kRuns; ++run, next += kPerRun) {
              const double base = time(plain, next);
              ratios.push_back(time(ask, next) / base);
            }
          }
          std::nth_element(ratios.begin(), ratios.begin() + static_cast<std::ptrdiff_t>(ratios.size() / 2), ratios.end());
          state.counters["ratio"] = ratios[ratios.size() / 2];
        })
        ->Iterations(1);
  }
}

template <class Ask>
void addQueryBenchmarks(const std::string& what, const std::string& name, const std::vector<Query>& queries, Ask ask) {
  benchmark::RegisterBenchmark((what + "_random/" + name).c_str(), [&queries, ask](benchmark::State& state) {
    std::size_t k = 0;
    for (auto _ : state) benchmark::DoNotOptimize(ask(queries[k++ % kQueries]));
  });
  benchmark::RegisterBenchmark((what + "_warm/" + name).c_str(), [&queries, ask](benchmark::State& state) {
    for (auto _ : state) benchmark::DoNotOptimize(ask(queries[0]));
  });
}

/// The queries as a renderer's wavefront has them.
struct QueryArrays {
  explicit QueryArrays(const std::vector<Query>& queries) {
    for (const Query& query : queries) {
      u.push_back(query.footprint.centre.x);
      v.push_back(query.footprint.centre.y);
      sigma.push_back(std::sqrt(query.footprint.covariance.xx));
      hx.push_back(query.half.x);
      hy.push_back(query.half.y);
      x0.push_back(query.range.low.x);
      y0.push_back(query.range.low.y);
      x1.push_back(query.range.high.x);
      y1.push_back(query.range.high.y);
      xi_x.push_back(query.xi.x);
      xi_y.push_back(query.xi.y);
    }
  }
  api::FootprintArrays footprints(std::size_t first) const {
    api::FootprintArrays p;
    p.u = {&u[first]};
    p.v = {&v[first]};
    p.sigma = {&sigma[first]};
    return p;
  }
  std::vector<float> u, v, sigma, hx, hy, x0, y0, x1, y1, xi_x, xi_y;
};

/// A batch of queries [first, first + count), and where its answers go.
struct Batch {
  std::vector<float> answers = std::vector<float>(3 * kBatch);
  void densities(const api::AnyNdf& model, const QueryArrays& q, std::size_t first, std::size_t count) {
    api::densities(model, count, q.footprints(first), {{&q.hx[first]}, {&q.hy[first]}}, answers.data());
  }
  void means(const api::AnyNdf& model, const QueryArrays& q, std::size_t first, std::size_t count) {
    api::means(model, count, q.footprints(first), {{&q.x0[first]}, {&q.y0[first]}, {&q.x1[first]}, {&q.y1[first]}},
               answers.data());
  }
  void samples(const api::AnyNdf& model, const QueryArrays& q, std::size_t first, std::size_t count) {
    float* out = answers.data();
    api::samples(model, count, q.footprints(first), {{&q.xi_x[first]}, {&q.xi_y[first]}},
                 {out, out + kBatch, out + 2 * kBatch});
  }
};

template <class Model>
void addBatchBenchmarks(const std::string& what, const std::string& name, const Model& model, const std::vector<Query>& queries,
                        float (*one)(const Model&, const Query&),
                        void (Batch::*many)(const api::AnyNdf&, const QueryArrays&, std::size_t, std::size_t)) {
  for (const bool few : {false, true}) {
    const std::string which = few ? "_few/" : "_random/";
    const std::size_t size = few ? kFew : kBatch;
    benchmark::RegisterBenchmark(
        (what + "_batch" + which + name).c_str(),
        [any = api::AnyNdf(model), arrays = QueryArrays(queries), few, size, many](benchmark::State& state) {
          Batch batch;
          std::size_t first = 0;
          while (state.KeepRunningBatch(static_cast<benchmark::IterationCount>(size))) {
            (batch.*many)(any, arrays, first, size);
            benchmark::DoNotOptimize(batch.answers.data());
            benchmark::ClobberMemory();
            if (!few) first = (first + size) % kQueries;
          }
        });
    benchmark::RegisterBenchmark(("ratio_batch_" + what + which + name).c_str(), [any = api::AnyNdf(model),
                                                                                  arrays = QueryArrays(queries), &model,
                                                                                  &queries, few, size, one,
                                                                                  many](benchmark::State& state) {
      constexpr int kRuns = 30;  // as many as there are different batches
      Batch batch;
      std::vector<double> ratios;
      for (auto _ : state) {
        for (int run = 0; run < kRuns; ++run) {
          // Half the queries away: what one way has read does not help the other.
          const std::size_t first = few ? 0 : run * kBatch % kQueries, other = few ? 0 : (first + kQueries / 2) % kQueries;
          const double start = threadSeconds();
          for (std::size_t done = 0; done < kBatch; done += size) (batch.*many)(any, arrays, first + (few ? 0 : done), size);
          const double middle = threadSeconds();
          for (std::size_t k = 0; k < kBatch; ++k) benchmark::DoNotOptimize(one(model, queries[other + k % size]));
          ratios.push_back((threadSeconds() - middle) / (middle - start));
        }
      }
      std::nth_element(ratios.begin(), ratios.begin() + kRuns / 2, ratios.end());
      state.counters["ratio"] = ratios[kRuns / 2];
    })->Iterations(1);
  }
}

template <class Model>
void addModelBenchmarks(const std::string& name, const Model& model, const std::vector<Query>& queries) {
  addQueryBenchmarks("density", name, queries, [&model](const Query& query) { return density(model, query); });
  benchmark::RegisterBenchmark(("density_few/" + name).c_str(), [&model, &queries](benchmark::State& state) {
    std::size_t k = 0;
    for (auto _ : state) benchmark::DoNotOptimize(density(model, queries[k++ % kFew]));
  });
  addBatchBenchmarks<Model>("density", name, model, queries, &density<Model>, &Batch::densities);
  addBatchBenchmarks<Model>("mean", name, model, queries, &mean<Model>, &Batch::means);
  addBatchBenchmarks<Model>("sample", name, model, queries, &sample<Model>, &Batch::samples);
  addQueryBenchmarks("mean", name, queries, [&model](const Query& query) { return mean(model, query); });
  addQueryBenchmarks("sample", name, queries, [&model](const Query& query) { return sample(model, query); });
  addRatio(
      "density", name, queries, [&model](const Query& query) { return density(model, query); }, plainDensity);
  addRatio(
      "sample", name, queries, [&model](const Query& query) { return sample(model, query); }, plainSample);
}

void addOpenBenchmark(const std::string& path, const std::string& name) {
  benchmark::RegisterBenchmark(("open/" + name).c_str(), [path](benchmark::State& state) {
    for (auto _ : state) benchmark::DoNotOptimize(formats::Asset::open(path));
    state.counters["file_bytes"] = static_cast<double>(std::filesystem::file_size(path));
  })->Unit(benchmark::kMillisecond);
}

/// The model that answers round footprints, which all queries have.
template <class Model>
const auto& roundModel(const Model& model) {
  if constexpr (requires { model.round(); })
    return model.round();
  else
    return model;
}

/// Deviations of the narrowest and the widest footprint that are asked, texels: those of the levels, where there are any.
template <class Model>
std::pair<float, float> footprintSizes(const Model& model) {
  constexpr float kNarrowest = 2, kWidest = 128;
  if constexpr (requires { model.round().shape(); }) {
    const PyramidShape& shape = model.round().shape();
    return {finestSigma(shape), kFootprintPerStride * shape.levels[shape.level_count - 1].stride};
  } else {
    return {kNarrowest, kWidest};
  }
}

}  // namespace

int main(int argc, char** argv) {
  benchmark::Initialize(&argc, argv);
  if (argc < 3) {
    std::fprintf(stderr, "usage: glint-query-bench NORMALS.glint ASSET.glint... [--benchmark_...]\n");
    return 1;
  }
  try {
    const formats::Asset normals = formats::Asset::open(argv[1]);
    // Lists: benchmarks keep references to their elements.
    std::list<api::OpenedNdf> assets;
    std::list<std::vector<Query>> queries;
    for (int k = 2; k < argc; ++k) {
      const std::string path = argv[k], name = std::filesystem::path(path).filename().string();
      addOpenBenchmark(path, name);
      std::visit(
          [&](const auto& model) {
            const auto [finest, coarsest] = footprintSizes(model);
            addModelBenchmarks(name, roundModel(model),
                               queries.emplace_back(randomQueries(normals.get<NormalMap>(), finest, coarsest)));
          },
          assets.emplace_back(api::OpenedNdf::open(path)).model());
    }
    addQueryBenchmarks("density", "ggx", queries.front(), plainDensity);
    addQueryBenchmarks("sample", "ggx", queries.front(), plainSample);
    addOpenBenchmark(argv[1], std::filesystem::path(argv[1]).filename().string());
    benchmark::RunSpecifiedBenchmarks();
  } catch (const std::exception& error) {
    std::fprintf(stderr, "glint-query-bench: error: %s\n", error.what());
    return 1;
  }
  benchmark::Shutdown();
}
