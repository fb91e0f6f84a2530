#include <tbb/parallel_for.h>

#include <algorithm>
#include <cmath>
#include <numbers>

#include "glint/bake/synth/kinds.h"

namespace glint::bake {
namespace {

constexpr float kPi = std::numbers::pi_v<float>;

/// Nearest multiple of `repeat` threads (at least one repeat) that fill `size`, so that the weave continues across the border of
/// the map.
int threadCount(int size, float thread_texels, int repeat) {
  const float repeats = static_cast<float>(size) / thread_texels / static_cast<float>(repeat);
  return repeat * std::max(1, static_cast<int>(std::lround(repeats)));
}

/// Height of a thread.
/// @param across    position across the thread, in [0, 1]
/// @param along     position along the thread, in widths of the threads that cross it
/// @param crossing  +1 where the thread lies on top, -1 where it lies below
float threadHeight(float across, float along, float crossing) {
  constexpr float kRoundness = 0.9f;  // below 1, so that the sides of a thread are steep but not vertical
  constexpr float kFibreDepth = 0.02f;
  constexpr float kFibres = 3;
  const float side = 2 * across - 1;
  const float body = std::sqrt(1 - kRoundness * side * side);
  const float fibres = std::sin(2 * kPi * (kFibres * across + along));
  return 0.35f * crossing + 0.5f * body + kFibreDepth * fibres;
}

/// Heights of threads that cross. u and v count threads.
/// @param warp  warp(column, v): how far the warp thread of a column lies on top, -1 to 1
/// @param weft  weft(row, u): the same of the weft thread of a row
template <class Warp, class Weft>
std::vector<float> wovenHeights(const SynthOptions& p, int repeat, const Warp& warp, const Weft& weft) {
  const float warp_width = static_cast<float>(p.width) / static_cast<float>(threadCount(p.width, p.feature_texels, repeat));
  const float weft_width = static_cast<float>(p.height) / static_cast<float>(threadCount(p.height, p.feature_texels, repeat));
  std::vector<float> heights(static_cast<std::size_t>(p.width) * p.height);
  tbb::parallel_for(0, p.height, [&](int j) {
    const float v = (static_cast<float>(j) + 0.5f) / weft_width;
    const float row = std::floor(v);
    float* line = heights.data() + static_cast<std::size_t>(j) * p.width;
    for (int i = 0; i < p.width; ++i) {
      const float u = (static_cast<float>(i) + 0.5f) / warp_width;
      const float column = std::floor(u);
      line[i] = std::max(threadHeight(u - column, v, warp(column, v)), threadHeight(v - row, u, weft(row, u)));
    }
  });
  return heights;
}

/// Height of a thread that follows a draft, at a place along it: cosines from crossing to crossing.
/// @param over  over(k): 1 where the thread lies on top of the k-th thread that it crosses, -1 where it lies below
template <class Over>
float followed(float along, const Over& over) {
  const float k = std::floor(along - 0.5f), way = along - 0.5f - k;
  const float share = 0.5f - 0.5f * std::cos(kPi * way);
  return (1 - share) * over(static_cast<int>(k)) + share * over(static_cast<int>(k) + 1);
}

/// A weave by a draft, which repeats every `repeat` threads.
/// @param warp_over  warp_over(column, row): whether the warp thread lies on top
template <class Draft>
std::vector<float> draftedHeights(const SynthOptions& p, int repeat, const Draft& warp_over) {
  const auto sign = [&](int column, int row) { return warp_over(column, row) ? 1.0f : -1.0f; };
  return wovenHeights(
      p, repeat,
      [&](float column, float v) { return followed(v, [&](int row) { return sign(static_cast<int>(column), row); }); },
      [&](float row, float u) { return followed(u, [&](int column) { return -sign(column, static_cast<int>(row)); }); });
}

/// k modulo n, 0 to n - 1.
int modulo(int k, int n) { return (k % n + n) % n; }

}  // namespace

std::vector<float> weaveHeights(const SynthOptions& p) {
  return wovenHeights(
      p, 2, [](float column, float v) { return std::cos(kPi * (v - 0.5f + column)); },
      [](float row, float u) { return -std::cos(kPi * (u - 0.5f + row)); });
}

std::vector<float> twillHeights(const SynthOptions& p) {
  constexpr int kRepeat = 4;  // two over, two under, one thread farther in each row
  return draftedHeights(p, kRepeat, [](int column, int row) { return modulo(column - row, kRepeat) < 2; });
}

std::vector<float> silkHeights(const SynthOptions& p) {
  constexpr int kRepeat = 8, kStep = 3;  // a satin of eight: seven over, one under, three threads farther in each row
  return draftedHeights(p, kRepeat, [](int column, int row) { return modulo(column - kStep * row, kRepeat) != 0; });
}

}  // namespace glint::bake
