#include "glint/bake/displace/vmf_fit.h"

#include <algorithm>
#include <array>
#include <bit>
#include <cmath>
#include <cstdint>
#include <numeric>

#include "glint/bake/common/counter_random.h"
#include "glint/bake/common/simd.h"
#include "glint/query/brdf/vmf_lobe.h"

namespace glint::bake {
namespace {

constexpr int kIterations = 24;
constexpr float kSeedKappa = 20;  // bandwidth of the first guess: lobes of 13 degrees overlap, so that normals can change lobe
constexpr float kBlurKappa = 51.3f;  // bandwidth of a lobe with a deviation of 8 degrees
constexpr int kTestNormals = 32;
/// A lobe with less than this share of the weight is dropped.
constexpr double kEmptyShare = 1e-5;

/// exp(x) for x <= 0, with a relative error below 3e-6; 0 below -87. Plain arithmetic, of which the compiler makes vectors.
inline float fastExp(float x) {
  const float clamped = std::max(x, -87.0f) * 1.44269504f;
  const float whole = std::floor(clamped);
  const float f = clamped - whole;
  const float p = 1 + f * (0.693147f + f * (0.2402265f + f * (0.0555041f + f * (0.0096181f + f * 0.0013333f))));
  const auto bits = static_cast<std::uint32_t>((static_cast<std::int32_t>(whole) + 127) << 23);
  return x < -87 ? 0.0f : p * std::bit_cast<float>(bits);
}

struct Lobe {
  Vec3 centre;
  float kappa = 0;
  double weight = 0;
};

/// Normals as arrays, of which the compiler makes vectors.
struct Normals {
  std::vector<float> x, y, z, weight;
  std::size_t size() const { return x.size(); }
  Vec3 at(std::size_t k) const { return {x[k], y[k], z[k]}; }
};

Normals split(std::span<const WeightedNormal> normals) {
  Normals out;
  for (const WeightedNormal& n : normals) {
    out.x.push_back(n.normal.x), out.y.push_back(n.normal.y), out.z.push_back(n.normal.z);
    out.weight.push_back(n.weight);
  }
  return out;
}

/// out[k] = scale * exp(kappa (dot(centre, n_k) - 1)). 1 - cosine is computed from the chord, which keeps digits that the
/// cosine loses near 1.
GLINT_MULTIVERSION void lobeValues(const float* x, const float* y, const float* z, std::size_t count, Vec3 centre, float kappa,
                                   float scale, float* out) {
  for (std::size_t k = 0; k < count; ++k) {
    const float dx = x[k] - centre.x, dy = y[k] - centre.y, dz = z[k] - centre.z;
    out[k] = scale * fastExp(-0.5f * kappa * (dx * dx + dy * dy + dz * dz));
  }
}

/// Factor that makes a lobe integrate to 2 pi over the sphere.
float lobeScale(float kappa) { return kappa / (1 - std::exp(-2 * kappa)); }

/// Bandwidth of the lobe with these moments.
/// @param scatter  weighted mean of |n - centre|^2 / 2 around the mean direction
float kappaOf(double scatter) {
  // Mean cosine r = 1 - scatter; kappa = r (3 - r^2) / (1 - r^2) (Banerjee et al. 2005).
  const double r = std::max(0.0, 1 - scatter);
  return static_cast<float>(std::min<double>(kMaxKappa, r * (3 - r * r) / std::max(1e-9, scatter * (1 + r))));
}

/// Draws the first centres from the normals (k-means++): a normal with probability in proportion to its weight times its
/// squared distance to the nearest centre so far.
std::vector<Lobe> firstLobes(const Normals& normals, std::size_t count) {
  std::vector<Lobe> lobes;
  std::vector<double> distance(normals.size(), 4);
  for (std::size_t l = 0; l < count; ++l) {
    double total = 0;
    for (std::size_t k = 0; k < normals.size(); ++k) total += normals.weight[k] * distance[k];
    if (total < 1e-9) break;  // all normals are centres already
    double left = total * randomPair(0x676c696e74, l, 0).x;
    std::size_t chosen = 0;
    for (std::size_t k = 0; k < normals.size(); ++k) {
      if (normals.weight[k] * distance[k] <= 0) continue;
      chosen = k;
      left -= normals.weight[k] * distance[k];
      if (left < 0) break;
    }
    const Vec3 centre = normals.at(chosen);
    for (std::size_t k = 0; k < normals.size(); ++k) {
      const Vec3 d = normals.at(k) - centre;
      distance[k] = std::min<double>(distance[k], dot(d, d));
    }
    lobes.push_back({centre, kSeedKappa, 1.0 / static_cast<double>(count)});
  }
  return lobes;
}

/// Share of each normal in each lobe: memory of one fit.
struct Shares {
  std::array<std::vector<float>, kMaxLobes> values;
  std::vector<float> inverse;
};

/// Turns values of lobes into shares: values[l][k] becomes the weight of normal k times the share that lobe l has in it.
GLINT_MULTIVERSION void normalise(const float* weight, std::size_t count, std::size_t lobes, Shares& shares) {
  float* inverse = shares.inverse.data();
  for (std::size_t k = 0; k < count; ++k) inverse[k] = 1e-30f;
  for (std::size_t l = 0; l < lobes; ++l)
    for (std::size_t k = 0; k < count; ++k) inverse[k] += shares.values[l][k];
  for (std::size_t k = 0; k < count; ++k) inverse[k] = weight[k] / inverse[k];
  for (std::size_t l = 0; l < lobes; ++l)
    for (std::size_t k = 0; k < count; ++k) shares.values[l][k] *= inverse[k];
}

/// The expectation step: computes the share of every normal in every lobe.
void shareOut(const Normals& normals, std::span<const Lobe> lobes, Shares& shares) {
  const std::size_t count = normals.size();
  for (std::size_t l = 0; l < lobes.size(); ++l) {
    shares.values[l].resize(count);
    lobeValues(normals.x.data(), normals.y.data(), normals.z.data(), count, lobes[l].centre, lobes[l].kappa,
               static_cast<float>(lobes[l].weight) * lobeScale(lobes[l].kappa), shares.values[l].data());
  }
  shares.inverse.resize(count);
  normalise(normals.weight.data(), count, lobes.size(), shares);
}

/// The maximisation step of one lobe: moves it to the mean of its normals.
void updateLobe(const Normals& normals, const std::vector<float>& share, double total, Lobe& lobe) {
  double w = 0, x = 0, y = 0, z = 0;
  for (std::size_t k = 0; k < normals.size(); ++k) {
    const double s = share[k];
    w += s, x += s * normals.x[k], y += s * normals.y[k], z += s * normals.z[k];
  }
  const double length = std::sqrt(x * x + y * y + z * z);
  lobe.weight = w / total;
  if (w <= 0 || length <= 0) return;
  lobe.centre = {static_cast<float>(x / length), static_cast<float>(y / length), static_cast<float>(z / length)};
  lobe.kappa = kappaOf(std::max(0.0, 1 - length / w));
}

}  // namespace

void fitLobes(std::span<const WeightedNormal> input, std::span<VmfLobe> out) {
  const Normals normals = split(input);
  double total = 0;
  for (const float w : normals.weight) total += w;
  std::vector<Lobe> lobes = firstLobes(normals, out.size());
  Shares shares;
  for (int iteration = 0; iteration < kIterations; ++iteration) {
    shareOut(normals, lobes, shares);
    for (std::size_t l = 0; l < lobes.size(); ++l) updateLobe(normals, shares.values[l], total, lobes[l]);
    std::erase_if(lobes, [](const Lobe& lobe) { return lobe.weight < kEmptyShare; });
  }
  std::sort(lobes.begin(), lobes.end(), [](const Lobe& a, const Lobe& b) { return a.weight > b.weight; });
  double kept = 0;
  for (const Lobe& lobe : lobes) kept += lobe.weight;
  std::fill(out.begin(), out.end(), VmfLobe{});
  for (std::size_t l = 0; l < lobes.size(); ++l)
    out[l] = {{lobes[l].centre.x, lobes[l].centre.y}, lobes[l].kappa, static_cast<float>(total * lobes[l].weight / kept)};
}

void averageOverLobes(std::span<const WeightedNormal> input, std::span<const VmfLobe> fitted, std::span<const float> values,
                      std::span<float> means) {
  std::fill(means.begin(), means.end(), 0.0f);
  const Normals normals = split(input);
  const std::size_t each = values.size() / input.size();
  std::vector<Lobe> lobes;
  for (const VmfLobe& lobe : fitted)
    if (lobe.amplitude > 0) lobes.push_back({lobeCentre(lobe), lobe.kappa, lobe.amplitude});
  Shares shares;
  shareOut(normals, lobes, shares);
  for (std::size_t l = 0; l < lobes.size(); ++l) {
    const std::vector<float>& share = shares.values[l];
    const double total = std::accumulate(share.begin(), share.end(), 0.0);
    for (std::size_t c = 0; c < each; ++c) {
      double sum = 0;
      for (std::size_t k = 0; k < share.size(); ++k) sum += static_cast<double>(share[k]) * values[k * each + c];
      means[l * each + c] = static_cast<float>(total > 0 ? sum / total : 0);
    }
  }
}

float lobeError(std::span<const WeightedNormal> input, std::span<const VmfLobe> lobes) {
  const Normals normals = split(input);
  const std::size_t count = normals.size();
  const std::size_t tests = std::min<std::size_t>(kTestNormals, count);
  std::vector<float> values(count);
  double difference = 0, norm = 0;
  for (std::size_t t = 0; t < tests; ++t) {
    const Vec3 at = normals.at(t * count / tests);
    lobeValues(normals.x.data(), normals.y.data(), normals.z.data(), count, at, kBlurKappa, lobeScale(kBlurKappa),
               values.data());
    double wanted = 0, fitted = 0;
    for (std::size_t k = 0; k < count; ++k) wanted += static_cast<double>(normals.weight[k]) * values[k];
    for (const VmfLobe& lobe : lobes) {
      if (lobe.amplitude <= 0) continue;
      const float blurred = lobe.kappa * kBlurKappa / (lobe.kappa + kBlurKappa);  // variances add
      const Vec3 d = at - lobeCentre(lobe);
      fitted += lobe.amplitude * lobeScale(blurred) * std::exp(-0.5f * blurred * dot(d, d));
    }
    difference += (wanted - fitted) * (wanted - fitted);
    norm += wanted * wanted;
  }
  return static_cast<float>(std::sqrt(difference / norm));
}

}  // namespace glint::bake
