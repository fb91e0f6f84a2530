#include <tbb/blocked_range.h>
#include <tbb/parallel_for.h>

#include <algorithm>
#include <cmath>
#include <numbers>

#include "glint/bake/common/counter_random.h"
#include "glint/bake/synth/kinds.h"

namespace glint::bake {
namespace {

constexpr float kPi = std::numbers::pi_v<float>;
constexpr std::uint64_t kScratchStream = 4;

/// A groove. In its own frame, s runs along it from 0 to `length`, and t across it.
struct Scratch {
  Vec2 start;
  Vec2 along;  ///< unit length
  float length = 0;
  float half_width = 0;
  float depth = 0;  ///< depth over half_width
  float bend = 0;   ///< largest t of the bent centre line

  /// Height of the groove at a point; 0 outside.
  float heightAt(Vec2 point) const {
    const Vec2 d = point - start;
    const float s = dot(d, along) / length;
    if (s <= 0 || s >= 1) return 0;
    const float centre = 4 * bend * s * (1 - s);
    const float t = (along.x * d.y - along.y * d.x - centre) / half_width;
    if (std::abs(t) >= 1) return 0;
    const float ends = std::min(1.0f, 8 * std::min(s, 1 - s));  // the groove runs out over an eighth of its length
    const float profile = (1 - t * t) * (1 - t * t);
    return -depth * half_width * profile * ends * ends * (3 - 2 * ends);
  }
};

/// Draws the positions and shapes of all scratches.
std::vector<Scratch> drawScratches(const SynthOptions& p) {
  const double squares = static_cast<double>(p.width) * p.height / (64.0 * 64.0);
  std::vector<Scratch> scratches(static_cast<std::size_t>(std::max(1.0, std::round(squares * p.density))));
  for (std::size_t i = 0; i < scratches.size(); ++i) {
    const Vec2 place = randomPair(p.seed, kScratchStream, 4 * i);
    const Vec2 shape = randomPair(p.seed, kScratchStream, 4 * i + 1);
    const Vec2 profile = randomPair(p.seed, kScratchStream, 4 * i + 2);
    const Vec2 turn = randomPair(p.seed, kScratchStream, 4 * i + 3);
    Scratch& scratch = scratches[i];
    scratch.start = {place.x * static_cast<float>(p.width), place.y * static_cast<float>(p.height)};
    scratch.along = {std::cos(2 * kPi * shape.x), std::sin(2 * kPi * shape.x)};
    scratch.length = 32 + 224 * shape.y * shape.y;
    scratch.half_width = 0.5f * p.feature_texels * (0.5f + profile.x);
    scratch.depth = 0.25f + 0.75f * profile.y;
    scratch.bend = 0.08f * scratch.length * (2 * turn.x - 1);
  }
  return scratches;
}

/// Cuts one scratch, moved by (shift_x, shift_y), into rows [first_row, last_row). The deepest cut stays, so the order of
/// scratches does not matter.
void carve(const SynthOptions& p, Scratch scratch, int shift_x, int shift_y, int first_row, int last_row,
           std::vector<float>& heights) {
  scratch.start = scratch.start + Vec2{static_cast<float>(shift_x), static_cast<float>(shift_y)};
  const Vec2 end = scratch.start + scratch.length * scratch.along;
  const float margin = scratch.half_width + std::abs(scratch.bend) + 1;
  const int y0 = std::max(first_row, static_cast<int>(std::floor(std::min(scratch.start.y, end.y) - margin)));
  const int y1 = std::min(last_row, static_cast<int>(std::ceil(std::max(scratch.start.y, end.y) + margin)));
  for (int j = y0; j < y1; ++j) {
    float low = std::min(scratch.start.x, end.x) - margin;
    float high = std::max(scratch.start.x, end.x) + margin;
    const float y = static_cast<float>(j) + 0.5f;
    // Limit the row to the part near the straight line from end to end.
    if (std::abs(scratch.along.y) > 0.05f) {
      const float x = scratch.start.x + (y - scratch.start.y) * scratch.along.x / scratch.along.y;
      const float reach = margin / std::abs(scratch.along.y);
      low = std::max(low, x - reach);
      high = std::min(high, x + reach);
    }
    float* line = heights.data() + static_cast<std::size_t>(j) * p.width;
    const int x1 = std::min(p.width, static_cast<int>(std::ceil(high)));
    for (int i = std::max(0, static_cast<int>(std::floor(low))); i < x1; ++i) {
      line[i] = std::min(line[i], scratch.heightAt({static_cast<float>(i) + 0.5f, y}));
    }
  }
}

}  // namespace

std::vector<float> scratchHeights(const SynthOptions& p) {
  const std::vector<Scratch> scratches = drawScratches(p);
  std::vector<float> heights(static_cast<std::size_t>(p.width) * p.height, 0.0f);
  float reach = 0;
  for (const Scratch& s : scratches) reach = std::max(reach, 1.2f * s.length + s.half_width + 2);
  const int copies_x = static_cast<int>(std::ceil(reach / static_cast<float>(p.width)));
  const int copies_y = static_cast<int>(std::ceil(reach / static_cast<float>(p.height)));
  constexpr int kBand = 64;
  tbb::parallel_for(tbb::blocked_range<int>(0, (p.height + kBand - 1) / kBand), [&](const tbb::blocked_range<int>& bands) {
    const int first_row = bands.begin() * kBand;
    const int last_row = std::min(p.height, bands.end() * kBand);
    for (const Scratch& scratch : scratches) {
      for (int y = -copies_y; y <= copies_y; ++y) {
        for (int x = -copies_x; x <= copies_x; ++x) {
          carve(p, scratch, x * p.width, y * p.height, first_row, last_row, heights);
        }
      }
    }
  });
  return heights;
}

namespace {

/// A pattern along u that repeats at whole parts of the map. @param height  of a phase in [0, 1), over a period of 1
template <class Height>
std::vector<float> periodicHeights(const SynthOptions& p, Height&& height) {
  const float teeth = std::max(1.0f, std::round(static_cast<float>(p.width) / p.feature_texels));
  const float period = static_cast<float>(p.width) / teeth;
  std::vector<float> row(static_cast<std::size_t>(p.width));
  for (int i = 0; i < p.width; ++i) {
    const float tooth = (static_cast<float>(i) + 0.5f) / period;
    row[static_cast<std::size_t>(i)] = period * height(tooth - std::floor(tooth));
  }
  std::vector<float> heights;
  heights.reserve(static_cast<std::size_t>(p.width) * p.height);
  for (int j = 0; j < p.height; ++j) heights.insert(heights.end(), row.begin(), row.end());
  return heights;
}

/// A ramp that rises over the share `rise` of a period.
float rampAt(float phase, float rise) { return std::min(phase / rise, (1 - phase) / (1 - rise)); }

}  // namespace

std::vector<float> sawtoothHeights(const SynthOptions& p) {
  constexpr float kRise = 0.75f;
  return periodicHeights(p, [](float phase) { return rampAt(phase, kRise); });
}

std::vector<float> gratingHeights(const SynthOptions& p) {
  constexpr float kRise = 0.875f;
  if (p.profile == GratingProfile::blazed) return periodicHeights(p, [](float phase) { return rampAt(phase, kRise); });
  return periodicHeights(p, [](float phase) { return std::sin(2 * std::numbers::pi_v<float> * phase); });
}

}  // namespace glint::bake
