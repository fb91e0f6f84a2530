// Opening assets and asking them:
//   glint-query-bench NORMALS.glint ASSET.glint... [--benchmark_format=json ...]
// Names are WHAT/FILE. `random`: footprints of every size anywhere, towards normals of the map, so that most queries miss the
// caches on big assets. `warm`: one such query again and again.

#include <benchmark/benchmark.h>

#include <cmath>
#include <filesystem>
#include <list>
#include <random>
#include <string>
#include <variant>
#include <vector>

#include "glint/formats/asset_reader.h"
#include "glint/query/cp_ndf.h"
#include "glint/query/pyramid_ndf.h"

namespace {

using namespace glint;

/// Enough that their blocks do not fit a cache of a few megabytes.
constexpr std::size_t kQueries = 1 << 15;
/// Half width of the range that `mean` is asked for: a light of about 6 degrees.
constexpr float kRangeReach = 0.05f;

struct Query {
  Footprint footprint;
  Vec2 half;
  Box2 range;
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
    query.range = {query.half - Vec2{kRangeReach, kRangeReach}, query.half + Vec2{kRangeReach, kRangeReach}};
  }
  return queries;
}

float density(const auto& model, const Query& query) { return model.density(query.footprint, query.half); }
float mean(const auto& model, const Query& query) { return model.mean(query.footprint, query.range); }

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

template <class Model>
void addModelBenchmarks(const std::string& name, const Model& model, const std::vector<Query>& queries) {
  addQueryBenchmarks("density", name, queries, [&model](const Query& query) { return density(model, query); });
  addQueryBenchmarks("mean", name, queries, [&model](const Query& query) { return mean(model, query); });
}

void addOpenBenchmark(const std::string& path, const std::string& name) {
  benchmark::RegisterBenchmark(("open/" + name).c_str(), [path](benchmark::State& state) {
    for (auto _ : state) benchmark::DoNotOptimize(formats::Asset::open(path));
    state.counters["file_bytes"] = static_cast<double>(std::filesystem::file_size(path));
  })->Unit(benchmark::kMillisecond);
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
    std::list<formats::Asset> assets;
    std::list<std::variant<PyramidNdf, CpNdf>> models;
    std::list<std::vector<Query>> queries;
    for (int k = 2; k < argc; ++k) {
      const std::string path = argv[k], name = std::filesystem::path(path).filename().string();
      addOpenBenchmark(path, name);
      const formats::Asset& asset = assets.emplace_back(formats::Asset::open(path));
      if (asset.kind() == "ndf-cp")
        models.emplace_back(CpNdf(asset.compressed()));
      else
        models.emplace_back(PyramidNdf(asset.pyramid()));
      std::visit(
          [&](const auto& model) {
            const PyramidShape& shape = model.shape();
            const float finest = finestSigma(shape),
                        coarsest = kFootprintPerStride * shape.levels[shape.level_count - 1].stride;
            addModelBenchmarks(name, model, queries.emplace_back(randomQueries(normals.normals(), finest, coarsest)));
          },
          models.back());
    }
    addOpenBenchmark(argv[1], std::filesystem::path(argv[1]).filename().string());
    benchmark::RunSpecifiedBenchmarks();
  } catch (const std::exception& error) {
    std::fprintf(stderr, "glint-query-bench: error: %s\n", error.what());
    return 1;
  }
  benchmark::Shutdown();
}
