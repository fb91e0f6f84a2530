#include "glint/bake/compressed/spots.h"

#include <algorithm>
#include <cmath>
#include <utility>

#include "glint/query/detail/compressed/spots.h"

namespace glint::bake {
namespace {

// A spot whose profile inside the block has a norm below this lies mostly in the neighbouring block, which stores it.
constexpr float kLeastNorm = 0.05f;

float powerOf(const float* scale) {
  float sum = 0;
  for (int k = 0; k < kBlockSize; ++k) sum += scale[k] * scale[k];
  return sum;
}

}  // namespace

std::vector<float> spotSums(float sigma_pixels) {
  std::vector<float> sums(kSpotSums);
  for (int k = 0; k < kSpotSums; ++k) {
    const double pixels = static_cast<double>(k - kSpotSums / 2) / kSpotSteps;
    sums[k] = static_cast<float>(0.5 * std::erfc(-pixels / (sigma_pixels * std::sqrt(2.0))));
  }
  return sums;
}

SpotFinder::Axis::Axis(const std::vector<float>& sums, const float* scale) {
  for (int place = 0; place <= kLastSpotPlace; ++place) {
    float power = 0, power_inside = 0, match = 0;
    for (int p = 0; p < kBlockSize; ++p) {
      const float* edge = sums.data() + kSpotSteps * p + kLastSpotPlace - place;
      const float mass = edge[kSpotSteps] - edge[0], scaled = mass * scale[p];
      profiles.push_back(scaled);
      power += scaled * scaled;
      power_inside += mass * mass;
      match += scaled * scale[p];
    }
    norms.push_back(std::sqrt(power));
    inside.push_back(std::sqrt(power_inside));
    even.push_back(match);
  }
}

SpotFinder::SpotFinder(float sigma_pixels, const BlockScale& scale)
    : scale_(scale),
      x_(spotSums(sigma_pixels), scale.x),
      y_(spotSums(sigma_pixels), scale.y),
      even_power_(powerOf(scale.x) * powerOf(scale.y)),
      reach_(static_cast<int>(std::ceil(3 * sigma_pixels)) + 1) {}

float SpotFinder::restDensity(float match, float left) const {
  // Least part of the squares that an even density must explain: it then stands for many facets.
  constexpr float kLeastPart = 0.2f;
  return match > 0 && match * match >= kLeastPart * left * even_power_ ? match / even_power_ : 0;
}

float SpotFinder::evenMatch(const float* slice) const {
  float sum = 0;
  for (int j = 0; j < kBlockSize; ++j) {
    float row = 0;
    for (int i = 0; i < kBlockSize; ++i) row += scale_.x[i] * slice[j * kBlockSize + i];
    sum += scale_.y[j] * row;
  }
  return sum;
}

void SpotFinder::setEven(float density, float* pixels) const {
  for (int j = 0; j < kBlockSize; ++j)
    for (int i = 0; i < kBlockSize; ++i) pixels[j * kBlockSize + i] = density * scale_.x[i] * scale_.y[j];
}

/// Dot product of the slice with the spot at a position, over the norm of the spot.
float SpotFinder::match(const float* slice, int x, int y) const {
  if (x_.inside[x] * y_.inside[y] < kLeastNorm) return 0;
  const float norm = x_.norms[x] * y_.norms[y];
  const int px = x / kSpotSteps - kSpotReach, py = y / kSpotSteps - kSpotReach;
  const int x0 = std::max(0, px - reach_), x1 = std::min(kBlockSize, px + reach_ + 1);
  const int y0 = std::max(0, py - reach_), y1 = std::min(kBlockSize, py + reach_ + 1);
  float sum = 0;
  for (int j = y0; j < y1; ++j) {
    float row = 0;
    for (int i = x0; i < x1; ++i) row += x_.profile(x)[i] * slice[j * kBlockSize + i];
    sum += y_.profile(y)[j] * row;
  }
  return sum / norm;
}

/// Climbs from (x, y) to the best position near it, with steps from half a pixel down to an eighth.
void SpotFinder::refine(const float* slice, int& x, int& y, float& best) const {
  for (int step = kSpotSteps / 2; step > 0; step /= 2) {
    for (bool moved = true; moved;) {
      moved = false;
      for (const auto& [dx, dy] : {std::pair{-step, 0}, {step, 0}, {0, -step}, {0, step}}) {
        const int to_x = x + dx, to_y = y + dy;
        if (to_x < 0 || to_y < 0 || to_x > kLastSpotPlace || to_y > kLastSpotPlace) continue;
        const float value = match(slice, to_x, to_y);
        if (!(value > best)) continue;
        best = value;
        x = to_x;
        y = to_y;
        moved = true;
      }
    }
  }
}

void SpotFinder::add(int x, int y, float weight, float* pixels) const {
  for (int j = 0; j < kBlockSize; ++j) {
    const float row = weight * y_.profile(y)[j];
    if (row == 0) continue;
    for (int i = 0; i < kBlockSize; ++i) pixels[j * kBlockSize + i] += row * x_.profile(x)[i];
  }
}

SliceSpots SpotFinder::find(float* slice, int most, float least) const {
  SliceSpots spots;
  while (static_cast<int>(spots.size()) < most) {
    const int peak = static_cast<int>(std::max_element(slice, slice + kBlockPixels) - slice);
    if (!(slice[peak] > 0)) break;
    int x = (peak % kBlockSize + kSpotReach) * kSpotSteps + kSpotSteps / 2;
    int y = (peak / kBlockSize + kSpotReach) * kSpotSteps + kSpotSteps / 2;
    float best = match(slice, x, y);
    refine(slice, x, y, best);
    const float gain = std::min(best * best, spots.empty() ? best * best : spots.back().gain);
    if (!(best > 0) || gain < least) break;
    const float weight = best / (x_.norms[x] * y_.norms[y]);
    add(x, y, -weight, slice);
    spots.push_back({static_cast<std::uint8_t>(x), static_cast<std::uint8_t>(y), weight, gain});
  }
  return spots;
}

}  // namespace glint::bake
