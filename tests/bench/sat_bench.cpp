// What a histogram costs: glint-sat-bench ASSET.glint... prints JSON. Footprints lie anywhere on the map, so that tables of
// many megabytes miss the caches as they do in a renderer. CPU time of the thread; median of rounds. At an angle also exactly,
// and how far the strips of the default tolerance are from that: total variation.

#include <algorithm>
#include <cmath>
#include <cstdio>
#include <ctime>
#include <filesystem>
#include <nlohmann/json.hpp>
#include <random>
#include <vector>

#include "glint/formats/asset_reader.h"
#include "glint/query/histogram_ndf.h"

namespace {

using namespace glint;

constexpr int kFootprints = 500;
constexpr int kRounds = 15;
constexpr int kExactRounds = 3;                               // they take up to half a millisecond each
constexpr int kSizes[] = {4, 16, 64, 256, 1024, 1900, 3000};  // texels along each side

double threadNanoseconds() {
  timespec now{};
  clock_gettime(CLOCK_THREAD_CPUTIME_ID, &now);
  return 1e9 * static_cast<double>(now.tv_sec) + static_cast<double>(now.tv_nsec);
}

std::vector<Footprint> footprints(int size, bool rotated) {
  std::mt19937 random(1);
  const auto unit = [&] { return static_cast<float>(random() >> 8) * 0x1p-24f; };
  std::vector<Footprint> list;
  for (int k = 0; k < kFootprints; ++k) {
    const float half = 0.5f * static_cast<float>(size), angle = rotated ? 2 * kPi * unit() : 0, u = unit(), v = unit();
    list.push_back(Footprint::box({u, v}, {half * std::cos(angle), half * std::sin(angle)},
                                  {-half * std::sin(angle), half * std::cos(angle)}));
  }
  return list;
}

template <class Ask>
double nanoseconds(const std::vector<Footprint>& list, Ask&& ask, int count = kRounds) {
  std::vector<double> rounds;
  for (int round = 0; round < count; ++round) {
    const double start = threadNanoseconds();
    for (const Footprint& p : list) ask(p);
    rounds.push_back((threadNanoseconds() - start) / static_cast<double>(list.size()));
  }
  std::nth_element(rounds.begin(), rounds.begin() + count / 2, rounds.end());
  return rounds[static_cast<std::size_t>(count / 2)];
}

double histogramNanoseconds(const HistogramNdf& ndf, const std::vector<Footprint>& list, int rounds = kRounds) {
  volatile float sink = 0;
  return nanoseconds(
      list, [&](const Footprint& p) { ndf.forEachBin(p, [&](int, float weight) { sink = weight; }); }, rounds);
}

/// Mean and largest total variation between the histograms of two models.
nlohmann::json variation(const HistogramNdf& a, const HistogramNdf& b, const std::vector<Footprint>& list) {
  double sum = 0, largest = 0;
  for (const Footprint& p : list) {
    std::vector<double> difference(static_cast<std::size_t>(a.binCount()));
    a.forEachBin(p, [&](int bin, float weight) { difference[static_cast<std::size_t>(bin)] += weight; });
    b.forEachBin(p, [&](int bin, float weight) { difference[static_cast<std::size_t>(bin)] -= weight; });
    double total = 0;
    for (const double d : difference) total += 0.5 * std::fabs(d);
    sum += total;
    largest = std::max(largest, total);
  }
  return {{"mean", sum / static_cast<double>(list.size())}, {"largest", largest}};
}

nlohmann::json measure(const HistogramSat& sat) {
  const HistogramNdf ndf(sat), exact(sat, GaussianBoxes::one, 0);
  volatile float sink = 0;
  nlohmann::json rows = nlohmann::json::array();
  for (const int size : kSizes) {
    for (const bool rotated : {false, true}) {
      const std::vector<Footprint> list = footprints(size, rotated);
      const double density = nanoseconds(list, [&](const Footprint& p) { sink = ndf.density(p, {0.1f, 0.05f}); });
      nlohmann::json row = {{"size_texels", size},
                            {"rotated", rotated},
                            {"histogram_ns", histogramNanoseconds(ndf, list)},
                            {"density_ns", density}};
      if (rotated) {
        row["exact_ns"] = histogramNanoseconds(exact, list, kExactRounds);
        row["variation"] = variation(ndf, exact, list);
      }
      rows.push_back(row);
    }
  }
  return rows;
}

}  // namespace

int main(int argc, char** argv) try {
  nlohmann::json assets = nlohmann::json::array();
  for (int k = 1; k < argc; ++k) {
    const formats::Asset asset = formats::Asset::open(argv[k]);
    const HistogramSat& sat = asset.get<HistogramSat>();
    assets.push_back({{"asset", argv[k]},
                      {"file_bytes", std::filesystem::file_size(argv[k])},
                      {"stride_texels", sat.stride},
                      {"bins", sat.bin_count},
                      {"queries", measure(sat)}});
  }
  std::printf("%s\n", assets.dump(1).c_str());
  return 0;
} catch (const Error& error) {
  std::fprintf(stderr, "glint-sat-bench: error: %s\n", error.what());
  return static_cast<int>(error.code());
}
