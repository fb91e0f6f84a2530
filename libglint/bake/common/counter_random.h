#pragma once

#include <cmath>
#include <cstdint>
#include <numbers>

#include "glint/math/hash.h"
#include "glint/math/vec.h"

namespace glint::bake {

/// 64 random bits for element `index` of stream `stream`: mixBits of a counter. Any thread can draw the
/// numbers of any element, so results do not depend on the order of the work.
inline std::uint64_t randomBits(std::uint64_t seed, std::uint64_t stream, std::uint64_t index) {
  const std::uint64_t key = mixBits(seed + kCounterStep * (stream + 1));
  return mixBits(key + kCounterStep * (index + 1));
}

/// Two independent numbers, uniform in the open interval (0, 1).
inline Vec2 randomPair(std::uint64_t seed, std::uint64_t stream, std::uint64_t index) {
  constexpr float kScale = 1.0f / 8388608;  // 2^-23: 23 bits plus a half are exact in float, and never reach 0 or 1
  const std::uint64_t bits = randomBits(seed, stream, index);
  return {(static_cast<float>(bits >> 41) + 0.5f) * kScale, (static_cast<float>((bits >> 9) & 0x7fffff) + 0.5f) * kScale};
}

/// Two independent numbers of the standard normal distribution (Box and Muller).
inline Vec2 randomGaussians(std::uint64_t seed, std::uint64_t stream, std::uint64_t index) {
  const Vec2 xi = randomPair(seed, stream, index);
  const float radius = std::sqrt(-2 * std::log(xi.x));
  const float angle = 2 * std::numbers::pi_v<float> * xi.y;
  return {radius * std::cos(angle), radius * std::sin(angle)};
}

}  // namespace glint::bake
