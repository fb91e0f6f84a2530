// Builds bin maps and asks them:
//   glint-binmap-bench [--quick | --range] [MAP]...
// Prints JSON: for each map and roughness the time of building, bytes, and the median time of the weights around a half vector
// for footprints of several sizes; errors of the density against Reference. Times are of one thread; builds use all. MAP: only
// maps of these names. --range: instead, one bin map for roughnesses of 0.01 to 0.16 beside one for each.

#include <tbb/global_control.h>

#include <algorithm>
#include <chrono>
#include <cmath>
#include <ctime>
#include <iostream>
#include <nlohmann/json.hpp>
#include <random>
#include <string>
#include <vector>

#include "glint/bake/bin_map/bin_map.h"
#include "glint/bake/synth/synth.h"
#include "glint/query/bin_map_ndf.h"
#include "glint/query/reference.h"

namespace {

using namespace glint;
using nlohmann::ordered_json;

constexpr int kBuilds = 7;
constexpr float kSides[] = {4, 16, 64, 256, 1024};
constexpr float kAlphas[] = {0.0025f, 0.01f, 0.04f, 0.16f};

struct Map {
  std::string name;
  NormalMap map;
  std::vector<Vec2> normals;
  std::vector<float> alphas;
};

Map finish(std::string name, int size, std::vector<Vec2> normals, std::vector<float> alphas) {
  Map m{std::move(name), {}, std::move(normals), std::move(alphas)};
  m.map.width = m.map.height = size;
  m.map.normals = m.normals;
  return m;
}

std::vector<Vec2> synthesised(bake::SynthKind kind, int size, float alpha) {
  bake::SynthOptions p = bake::defaultSynthOptions(kind);
  p.width = p.height = size;
  p.alpha = alpha;
  return bake::synthNormals(p);
}

/// Independent normals of a Beckmann distribution.
std::vector<Vec2> beckmannNoise(int size, float alpha) {
  std::mt19937 random(5);
  std::normal_distribution<float> slope(0, alpha / std::sqrt(2.0f));
  std::vector<Vec2> normals(static_cast<std::size_t>(size) * static_cast<std::size_t>(size));
  for (Vec2& n : normals) {
    const float x = slope(random), y = slope(random), scale = 1 / std::sqrt(1 + x * x + y * y);
    n = {-x * scale, -y * scale};
  }
  return normals;
}

std::vector<Vec2> eightBits(std::vector<Vec2> normals) {
  for (Vec2& n : normals) {
    n = {std::round((n.x + 1) * 127.5f) / 127.5f - 1, std::round((n.y + 1) * 127.5f) / 127.5f - 1};
    if (const float length = std::sqrt(dot(n, n)); length > 0.999f) n = (0.999f / length) * n;
  }
  return normals;
}

double median(std::vector<double> values) {
  std::nth_element(values.begin(), values.begin() + static_cast<std::ptrdiff_t>(values.size() / 2), values.end());
  return values[values.size() / 2];
}

double now() { return std::chrono::duration<double>(std::chrono::steady_clock::now().time_since_epoch()).count(); }
double cpuSeconds() { return static_cast<double>(std::clock()) / CLOCKS_PER_SEC; }

struct Query {
  Footprint footprint;
  Vec2 half;
};

std::vector<Query> randomQueries(const Map& m, float side, std::size_t count, float turn) {
  std::mt19937 random(7);
  const auto unit = [&] { return static_cast<float>(random() >> 8) * 0x1p-24f; };
  std::vector<Query> queries(count);
  for (Query& q : queries) {
    const Vec2 centre = {unit(), unit()};
    const float a = turn * unit(), c = 0.5f * side * std::cos(a), s = 0.5f * side * std::sin(a);
    q.footprint = Footprint::box(centre, {c, s}, {-s, c});
    q.half = m.normals[random() % m.normals.size()];
  }
  return queries;
}

template <class Ask>
double medianNanoseconds(const std::vector<Query>& queries, Ask ask) {
  std::vector<double> times;
  times.reserve(queries.size());
  double sink = 0;
  for (const Query& q : queries) {
    const auto start = std::chrono::steady_clock::now();
    sink += ask(q);
    times.push_back(std::chrono::duration<double, std::nano>(std::chrono::steady_clock::now() - start).count());
  }
  volatile double keep = sink;
  static_cast<void>(keep);
  return median(times);
}

/// Median relative error of the density against Reference within two deviations of a normal of the footprint, where a renderer
/// finds a glint, and the error of all densities together.
ordered_json errors(const Map& m, const BinMapNdf& ndf, float side, std::size_t count) {
  const Reference reference(m.map, ndf.sigma());
  const BinMapNdf published(ndf.map(), ndf.map().alpha_min, BinEstimator::published);
  std::vector<double> relative, published_relative;
  double sum = 0, expected = 0;
  std::mt19937 random(9);
  const auto unit = [&] { return static_cast<float>(random() >> 8) * 0x1p-24f; };
  for (Query& q : randomQueries(m, side, count, 0)) {
    const Vec2 at = q.footprint.centre;
    const float radius = 2 * ndf.sigma() * unit(), angle = 2 * kPi * unit();
    q.half = m.map.at(static_cast<int>(at.x * static_cast<float>(m.map.width)),
                      static_cast<int>(at.y * static_cast<float>(m.map.height))) +
             radius * Vec2{std::cos(angle), std::sin(angle)};
    const double truth = reference.density(q.footprint, q.half), value = ndf.density(q.footprint, q.half);
    relative.push_back(std::abs(value / truth - 1));
    if (ndf.sigma() == published.sigma())
      published_relative.push_back(std::abs(double{published.density(q.footprint, q.half)} / truth - 1));
    sum += value, expected += truth;
  }
  ordered_json result = {{"side", side}, {"median", median(relative)}, {"energy", sum / expected - 1}};
  if (!published_relative.empty()) result["published_median"] = median(published_relative);
  return result;
}

ordered_json measure(const Map& m, float alpha, std::size_t queries) {
  std::vector<double> wall, cpu;
  bake::BinMapData data;
  for (int k = 0; k < kBuilds; ++k) {
    data = {};
    const double start = now(), cpu_start = cpuSeconds();
    data = bake::buildBinMap(m.map, {alpha});
    wall.push_back(now() - start);
    cpu.push_back(cpuSeconds() - cpu_start);
  }
  const BinMapNdf ndf(data.view()), published(data.view(), alpha, BinEstimator::published);
  ordered_json result = {{"map", m.name},
                         {"size", m.map.width},
                         {"alpha", alpha},
                         {"build_ms", 1e3 * median(wall)},
                         {"build_cpu_ms", 1e3 * median(cpu)},
                         {"bytes", data.sizeBytes()},
                         {"blocks", ndf.map().blockCount()}};
  for (const float side : kSides) {
    const auto aligned = randomQueries(m, side, queries, 0), turned = randomQueries(m, side, queries / 10, kPi);
    const auto weights = [&](const Query& q) { return ndf.weights(q.footprint, q.half).weights[0]; };
    const std::vector<Query> fewer(aligned.begin(), aligned.begin() + static_cast<std::ptrdiff_t>(queries / 10));
    const auto densityOf = [](const BinMapNdf& asked) {
      return [&asked](const Query& q) { return asked.density(q.footprint, q.half); };
    };
    ordered_json entry = {{"side", side}};
    entry["weights_ns"] = medianNanoseconds(aligned, weights);
    entry["turned_ns"] = medianNanoseconds(turned, weights);
    entry["density_ns"] = medianNanoseconds(fewer, densityOf(ndf));
    entry["turned_density_ns"] = medianNanoseconds(turned, densityOf(ndf));
    entry["published_ns"] = medianNanoseconds(fewer, densityOf(published));
    result["queries"].push_back(entry);
  }
  for (const float side : {8.0f, 16.0f, 64.0f, 256.0f}) result["errors"].push_back(errors(m, ndf, side, side < 200 ? 400 : 60));
  return result;
}

/// One bin map for a range of roughnesses beside one for each: bytes, building, and time and error of densities.
ordered_json measureRange(const Map& m, std::size_t queries) {
  const std::vector<float> alphas = {0.01f, 0.02f, 0.04f, 0.08f, 0.16f};
  const auto built = [&](const bake::BinMapOptions& options, double& seconds) {
    const double start = now();
    bake::BinMapData data = bake::buildBinMap(m.map, options);
    seconds += now() - start;
    return data;
  };
  double together_s = 0, apart_s = 0;
  std::size_t apart_bytes = 0;
  const bake::BinMapData together = built({alphas.front(), 8, alphas.back()}, together_s);
  ordered_json answers = ordered_json::array();
  for (const float alpha : alphas) {
    const bake::BinMapData apart = built({alpha, 8}, apart_s);
    apart_bytes += apart.sizeBytes();
    const BinMapNdf one(together.view(), alpha), own(apart.view());
    for (const float side : {4.0f, 16.0f, 64.0f, 256.0f, 1024.0f}) {
      const auto asked = randomQueries(m, side, queries / (side < 200 ? 10 : 40), 0);
      const auto time = [&](const BinMapNdf& ndf) {
        return medianNanoseconds(asked, [&](const Query& q) { return ndf.density(q.footprint, q.half); });
      };
      ordered_json entry = {{"alpha", alpha}, {"side", side}, {"range_ns", time(one)}, {"own_ns", time(own)}};
      if (side < 200) {
        entry["range_error"] = errors(m, one, side, 200);
        entry["own_error"] = errors(m, own, side, 200);
      }
      answers.push_back(entry);
    }
  }
  return {{"map", m.name},
          {"range", {alphas.front(), alphas.back()}},
          {"bins_for", together.alpha},
          {"range_bytes", together.sizeBytes()},
          {"own_bytes", apart_bytes},
          {"range_build_ms", 1e3 * together_s},
          {"own_build_ms", 1e3 * apart_s},
          {"densities", answers}};
}

}  // namespace

int main(int argc, char** argv) {
  const std::vector<std::string> arguments(argv + 1, argv + argc);
  const bool quick = !arguments.empty() && arguments[0] == "--quick", range = !arguments.empty() && arguments[0] == "--range";
  const std::vector<std::string> names(arguments.begin() + (quick || range), arguments.end());
  const tbb::global_control threads(tbb::global_control::max_allowed_parallelism, 2);
  using enum bake::SynthKind;
  const std::vector<float> all(std::begin(kAlphas), std::end(kAlphas));
  ordered_json results = ordered_json::array();
  const auto add = [&](const std::string& name, int size, const auto& normals, const std::vector<float>& alphas) {
    if (!names.empty() && std::find(names.begin(), names.end(), name) == names.end()) return;
    const Map map = finish(name, size, normals(), alphas);
    if (range) {
      results.push_back(measureRange(map, 2000));
      return;
    }
    for (const float alpha : map.alphas) results.push_back(measure(map, alpha, quick ? 2000 : 20000));
  };
  add(
      "isotropic 1K", 1024, [] { return synthesised(isotropic, 1024, 0.2f); }, all);
  add(
      "Gaussian 2K", 2048, [] { return beckmannNoise(2048, 0.6f); }, all);
  add("brushed 2K", 2048, [] { return synthesised(brushed, 2048, 0.2f); }, {0.01f});
  add(
      "8-bit isotropic 1K", 1024, [] { return eightBits(synthesised(isotropic, 1024, 0.2f)); }, all);
  std::cout << results.dump(1) << "\n";
  return 0;
}
