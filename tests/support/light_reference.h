#pragma once

// Light integrals by brute force, and the light to try them on.

#include <algorithm>
#include <cmath>
#include <functional>
#include <numbers>
#include <vector>

#include "glint/bake/sh/environment.h"
#include "glint/bake/sh/gauss_legendre.h"
#include "glint/model/footprint.h"

namespace glint::test {

/// A histogram that is the same for every footprint: the interface that ShLightQuery asks.
struct FixedHistogram {
  std::vector<Vec2> normals;
  std::vector<float> weights;

  template <class Visitor>
  void forEachBin(const Footprint&, Visitor&& visitor) const {
    for (std::size_t k = 0; k < normals.size(); ++k) visitor(static_cast<int>(k), weights[k]);
  }
  Vec2 binNormal(int bin) const { return normals[static_cast<std::size_t>(bin)]; }
};

inline bake::Environment makeEnvironment(int height, const std::function<float(Vec3, int)>& radiance) {
  bake::Environment e{2 * height, height, {}};
  const float pi = std::numbers::pi_v<float>, rows = static_cast<float>(height);
  for (int j = 0; j < height; ++j) {
    for (int i = 0; i < 2 * height; ++i) {
      const float theta = pi * (1 - (static_cast<float>(j) + 0.5f) / rows), phi = pi * (static_cast<float>(i) + 0.5f) / rows;
      const Vec3 d = {std::sin(theta) * std::cos(phi), std::sin(theta) * std::sin(phi), std::cos(theta)};
      for (int c = 0; c < 3; ++c) e.rgb.push_back(radiance(d, c));
    }
  }
  return e;
}

inline Vec3 unit(Vec3 v) { return 1 / std::sqrt(dot(v, v)) * v; }

/// A spot of some degrees around a direction.
inline float spot(Vec3 d, Vec3 towards, float degrees) {
  return dot(d, unit(towards)) > std::cos(degrees * std::numbers::pi_v<float> / 180) ? 1.0f : 0.0f;
}

/// The light that errors are measured under.
enum class TestLight { constant, bright_spot, studio };

/// constant: 1 everywhere. bright_spot: 5 degrees of 1000 in darkness. studio: a sky, a sun of 1.5 degrees and 1500, a window
/// of 12 degrees, stripes, and dark ground.
inline bake::Environment testEnvironment(TestLight light, int height) {
  return makeEnvironment(height, [light](Vec3 d, int c) {
    if (light == TestLight::constant) return 1.0f;
    if (light == TestLight::bright_spot) return 1000 * spot(d, {0.5f, 0.3f, 0.8f}, 5);
    const float tint = 1 - 0.2f * static_cast<float>(c);
    const float sky = d.z > 0 ? 0.3f + 0.7f * d.z * (2 - tint) : 0.1f * tint;
    const float stripes = d.z > 0.1f && d.z < 0.4f && std::sin(12 * std::atan2(d.y, d.x)) > 0.3f ? 2.0f : 0.0f;
    return sky + stripes + 1500 * tint * spot(d, {-0.4f, 0.5f, 0.75f}, 1.5f) + 8 * spot(d, {0.8f, -0.3f, 0.4f}, 12);
  });
}

/// Integral of L(wi) D(h) dwi over the directions above the surface (normal +z), for lobes of sigma_r around the bins' normals:
/// many directions of every lobe, one after the other.
/// @param steps  polar nodes of a lobe; twice as many around it
inline std::vector<double> lightIntegralByQuadrature(const bake::Environment& e, const FixedHistogram& histogram,
                                                     double sigma_r, Vec3 wo, int steps) {
  const double pi = std::numbers::pi, reach = std::min(pi / 2, 6.5 * sigma_r);
  const bake::GaussLegendre rule = bake::gaussLegendre(steps, 0, reach);
  std::vector<double> sum(3);
  for (std::size_t b = 0; b < histogram.normals.size(); ++b) {
    const Vec2 n = histogram.normals[b];
    const float nz = std::sqrt(1 - dot(n, n));
    const Vec3 m = {n.x, n.y, nz};
    const Vec3 u = unit(nz < 0.9f ? Vec3{-m.y, m.x, 0} : Vec3{m.z, 0, -m.x});
    const Vec3 v = {m.y * u.z - m.z * u.y, m.z * u.x - m.x * u.z, m.x * u.y - m.y * u.x};
    for (std::size_t a = 0; a < rule.nodes.size(); ++a) {
      const double s = std::sin(rule.nodes[a]), c = std::cos(rule.nodes[a]);
      const double lobe = std::exp(-0.5 * s * s / (sigma_r * sigma_r)) / (2 * pi * sigma_r * sigma_r);
      for (int k = 0; k < 2 * steps; ++k) {
        const double phi = pi * (k + 0.5) / steps;
        const Vec3 h =
            static_cast<float>(c) * m + static_cast<float>(s * std::cos(phi)) * u + static_cast<float>(s * std::sin(phi)) * v;
        const float ho = dot(h, wo);
        const Vec3 wi = 2 * ho * h - wo;
        if (!(ho > 0 && wi.z > 0)) continue;
        const double weight = histogram.weights[b] / nz * lobe * s * rule.weights[a] * (pi / steps) * 4 * ho;
        const float* radiance = e.at(wi);
        for (std::size_t channel = 0; channel < 3; ++channel) sum[channel] += weight * radiance[channel];
      }
    }
  }
  return sum;
}

}  // namespace glint::test
