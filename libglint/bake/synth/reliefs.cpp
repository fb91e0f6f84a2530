#include <tbb/parallel_for.h>

#include <algorithm>
#include <cmath>

#include "glint/bake/synth/kinds.h"

namespace glint::bake {
namespace {

/// Number of pieces of about `texels` that fill `size`, a multiple of `repeat`.
int pieceCount(int size, float texels, int repeat = 1) {
  return repeat * std::max(1, static_cast<int>(std::lround(static_cast<float>(size) / texels / static_cast<float>(repeat))));
}

/// Heights by a function of the place, height(u, v), which count pieces along each axis.
template <class Height>
std::vector<float> heightsOf(const SynthOptions& p, int columns, int rows, const Height& height) {
  const float width = static_cast<float>(p.width) / static_cast<float>(columns);
  const float depth = static_cast<float>(p.height) / static_cast<float>(rows);
  std::vector<float> heights(static_cast<std::size_t>(p.width) * p.height);
  tbb::parallel_for(0, p.height, [&](int j) {
    float* line = heights.data() + static_cast<std::size_t>(j) * p.width;
    for (int i = 0; i < p.width; ++i)
      line[i] = height((static_cast<float>(i) + 0.5f) / width, (static_cast<float>(j) + 0.5f) / depth);
  });
  return heights;
}

/// Noise of a standard deviation of 1.
std::vector<float> unitNoise(const SynthOptions& p, float correlation_x, float correlation_y) {
  std::vector<float> noise = noiseHeights(p, correlation_x, correlation_y);
  double squares = 0;
  for (const float n : noise) squares += double{n} * n;
  const double deviation = std::sqrt(squares / static_cast<double>(noise.size()));
  for (float& n : noise) n = deviation > 0 ? static_cast<float>(n / deviation) : 0;
  return noise;
}

float smoothStep(float low, float high, float x) {
  const float t = std::clamp((x - low) / (high - low), 0.0f, 1.0f);
  return t * t * (3 - 2 * t);
}

}  // namespace

std::vector<float> scaleHeights(const SynthOptions& p) {
  // A scale is rooted in its row and reaches over the rows below, where its round tip lies on top. Every second row is half a
  // scale farther.
  constexpr float kReach = 2.2f;       // length of a scale, in rows
  constexpr float kRoundness = 0.45f;  // how much shorter a scale is at its sides
  constexpr float kArch = 0.25f;       // how much lower it is there
  const int columns = pieceCount(p.width, p.feature_texels), rows = pieceCount(p.height, 0.5f * p.feature_texels, 2);
  return heightsOf(p, columns, rows, [](float u, float v) {
    float highest = 0;
    const auto first = static_cast<int>(std::floor(v));
    for (int row = first; row <= first + static_cast<int>(kReach) + 1; ++row) {
      const float along = (static_cast<float>(row) - v) / kReach;
      const float shifted = u - 0.5f * static_cast<float>(row & 1);
      const float side = 2 * (shifted - std::floor(shifted)) - 1, side2 = side * side;
      if (along >= 0 && along <= 1 - kRoundness * side2) highest = std::max(highest, along * (1 - kArch * side2));
    }
    return highest;
  });
}

std::vector<float> structuredHeights(const SynthOptions& p) {
  const int columns = pieceCount(p.width, p.feature_texels), rows = pieceCount(p.height, p.feature_texels);
  return heightsOf(p, columns, rows, [](float u, float v) {
    const float x = u - std::floor(u) - 0.5f, y = v - std::floor(v) - 0.5f;
    return 0.5f - std::max(std::abs(x), std::abs(y));
  });
}

std::vector<float> reliefHeights(const SynthOptions& p) {
  constexpr float kWall = 0.25f;  // noise between -this and this, in its standard deviations, is a wall
  std::vector<float> heights = unitNoise(p, 0.5f * p.feature_texels, 0.5f * p.feature_texels);
  for (float& h : heights) h = smoothStep(-kWall, kWall, h);
  return heights;
}

std::vector<float> woodHeights(const SynthOptions& p) {
  constexpr float kWander = 0.7f;  // standard deviation of a ring from its straight line, in distances of rings
  constexpr float kRise = 0.8f;    // share of a ring in which wood grows denser, and wears less
  const int rings = pieceCount(p.height, p.feature_texels);
  const std::vector<float> wander = unitNoise(p, p.streak_texels, 2 * p.feature_texels);
  std::vector<float> heights(static_cast<std::size_t>(p.width) * p.height);
  tbb::parallel_for(0, p.height, [&](int j) {
    const float straight = (static_cast<float>(j) + 0.5f) * static_cast<float>(rings) / static_cast<float>(p.height);
    for (int i = 0; i < p.width; ++i) {
      const std::size_t t = static_cast<std::size_t>(j) * p.width + static_cast<std::size_t>(i);
      const float ring = straight + kWander * wander[t], phase = ring - std::floor(ring);
      heights[t] = phase < kRise ? smoothStep(0, kRise, phase) : 1 - smoothStep(kRise, 1, phase);
    }
  });
  return heights;
}

}  // namespace glint::bake
