#pragma once

#include <cmath>
#include <cstddef>
#include <cstdint>
#include <cstring>
#include <functional>
#include <numbers>
#include <vector>

#include "glint/math/vec.h"

namespace glint::test {

/// A BRDF of a light and a view around the normal (0, 0, 1), in one channel.
using BrdfFunction = std::function<double(Vec3 wi, Vec3 wo, int channel)>;

/// The two directions of these angles (Rusinkiewicz 1998): the difference is turned by theta_h around y.
inline void directionsOf(double theta_h, double theta_d, double phi_d, Vec3& wi, Vec3& wo) {
  const double x = std::sin(theta_d) * std::cos(phi_d), y = std::sin(theta_d) * std::sin(phi_d), z = std::cos(theta_d);
  const double c = std::cos(theta_h), s = std::sin(theta_h);
  wi = {static_cast<float>(c * x + s * z), static_cast<float>(y), static_cast<float>(c * z - s * x)};
  wo = {static_cast<float>(s * z - c * x), static_cast<float>(-y), static_cast<float>(c * z + s * x)};
}

/// A file in MERL's form: the BRDF at the middles of bins.
inline std::vector<std::byte> merlFile(const BrdfFunction& brdf, int half = 90, int difference = 90, int azimuth = 180) {
  constexpr double kPi = std::numbers::pi, kScales[3] = {1 / 1500.0, 1.15 / 1500, 1.66 / 1500};
  const std::size_t plane =
      static_cast<std::size_t>(half) * static_cast<std::size_t>(difference) * static_cast<std::size_t>(azimuth);
  const std::int32_t sizes[3] = {half, difference, azimuth};
  std::vector<std::byte> bytes(sizeof sizes + 3 * plane * sizeof(double));
  std::memcpy(bytes.data(), sizes, sizeof sizes);
  for (std::size_t k = 0; k < plane; ++k) {
    const auto a = static_cast<double>(k % static_cast<std::size_t>(azimuth));
    const auto d = static_cast<double>(k / static_cast<std::size_t>(azimuth) % static_cast<std::size_t>(difference));
    const auto h = static_cast<double>(k / (static_cast<std::size_t>(azimuth) * static_cast<std::size_t>(difference)));
    Vec3 wi, wo;
    directionsOf(0.5 * kPi * std::pow((h + 0.5) / half, 2), 0.5 * kPi * (d + 0.5) / difference, kPi * (a + 0.5) / azimuth, wi,
                 wo);
    for (int c = 0; c < 3; ++c) {
      const double value = brdf(wi, wo, c) / kScales[c];
      std::memcpy(bytes.data() + sizeof sizes + (static_cast<std::size_t>(c) * plane + k) * sizeof value, &value, sizeof value);
    }
  }
  return bytes;
}

/// MERL's angles of two directions at a normal, by trigonometry alone.
struct MerlAngles {
  double half, difference, azimuth;
};
inline MerlAngles merlAngles(Vec3 wi, Vec3 wo, Vec3 n) {
  const auto clamped = [](double x) { return std::acos(x < -1 ? -1 : x > 1 ? 1 : x); };
  const Vec3 sum = wi + wo, h = (1 / std::sqrt(dot(sum, sum))) * sum;
  const auto across = [&](Vec3 v) { return v - dot(v, h) * h; };
  const auto cross = [](Vec3 a, Vec3 b) { return Vec3{a.y * b.z - a.z * b.y, a.z * b.x - a.x * b.z, a.x * b.y - a.y * b.x}; };
  // The normal lies at azimuth pi in the frame of the half vector.
  const Vec3 from = -1.0f * across(n), to = across(wi);
  return {clamped(dot(n, h)), clamped(dot(wi, h)), std::atan2(dot(h, cross(from, to)), dot(from, to))};
}

}  // namespace glint::test
