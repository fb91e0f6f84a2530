#include "glint-plan/probe_map.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <limits>

#include "glint/bake/common/counter_random.h"

namespace glint::apps {
namespace {

constexpr int kParts = 4;
constexpr int kBins = 32;

using Histogram = std::array<double, static_cast<std::size_t>(kBins) * kBins>;

/// Share of the normals in each of 32 x 32 squares of the disk.
template <class Normals>
Histogram histogramOf(const Normals& normals) {
  Histogram shares{};
  const double share = 1.0 / static_cast<double>(normals.size());
  const auto bin = [](float x) { return std::clamp(static_cast<int>((x + 1) * kBins / 2), 0, kBins - 1); };
  for (const Vec2& n : normals) shares[static_cast<std::size_t>(bin(n.y) * kBins + bin(n.x))] += share;
  return shares;
}

double differenceOf(const Histogram& a, const Histogram& b) {
  double sum = 0;
  for (std::size_t k = 0; k < a.size(); ++k) sum += std::abs(a[k] - b[k]);
  return sum / 2;
}

ProbeMap choiceOf(const NormalMap& map, int edge, std::uint64_t seed, std::uint64_t choice) {
  const int piece = edge / kParts;
  ProbeMap probe = {edge, edge, std::vector<Vec2>(static_cast<std::size_t>(edge) * edge)};
  for (int part = 0; part < kParts * kParts; ++part) {
    const int a = part % kParts, b = part / kParts;
    const Vec2 random = bake::randomPair(seed, choice, static_cast<std::uint64_t>(part));
    const auto first = [&](int index, int size, float share) {
      const int begin = index * size / kParts, spare = std::max(0, size / kParts - piece);
      return std::min(begin + static_cast<int>(share * static_cast<float>(spare + 1)), size - piece);
    };
    const int left = first(a, map.width, random.x), low = first(b, map.height, random.y);
    for (int j = 0; j < piece; ++j)
      for (int i = 0; i < piece; ++i)
        probe.normals[static_cast<std::size_t>(b * piece + j) * edge + a * piece + i] = map.at(left + i, low + j);
  }
  return probe;
}

}  // namespace

ProbeMap probeMap(const NormalMap& map, int edge, std::uint64_t seed) {
  constexpr std::uint64_t kChoices = 8;
  const Histogram wanted = histogramOf(map.normals);
  ProbeMap best;
  double least = std::numeric_limits<double>::infinity();
  for (std::uint64_t choice = 0; choice < kChoices; ++choice) {
    ProbeMap probe = choiceOf(map, edge, seed, choice);
    const double difference = differenceOf(histogramOf(probe.normals), wanted);
    if (difference < least) least = difference, best = std::move(probe);
  }
  return best;
}

}  // namespace glint::apps
