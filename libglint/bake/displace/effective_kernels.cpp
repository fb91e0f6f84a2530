#include "glint/bake/displace/effective_kernels.h"

#include <algorithm>
#include <cmath>
#include <numbers>

#include "glint/query/brdf/base_brdf.h"

#undef HWY_TARGET_INCLUDE
#define HWY_TARGET_INCLUDE "glint/bake/displace/effective_kernels.cpp"
#include <hwy/foreach_target.h>
#include <hwy/highway.h>

HWY_BEFORE_NAMESPACE();
namespace glint::bake::HWY_NAMESPACE {
namespace hn = hwy::HWY_NAMESPACE;

// No vector is wider than eight lanes, so that sums over facets are the same on every processor with fused products and sums.
constexpr std::size_t kSums = 8;
using Floats = hn::CappedTag<float, kSums>;
constexpr std::size_t kLanes = hn::MaxLanes(Floats());

/// A plain loop, of which the compiler makes vectors.
void MultiplyCosines(const DirectionTable& directions, Vec3 normal, float* row) {
  const float *x = directions.x.data(), *y = directions.y.data(), *z = directions.z.data();
  const std::size_t count = directions.padded;
  for (std::size_t d = 0; d < count; ++d) row[d] *= std::max(0.0f, x[d] * normal.x + y[d] * normal.y + z[d] * normal.z);
}

/// Tiles of 4 x 16 sums stay in registers.
void AddProducts(const float* a, const float* b, std::size_t count, std::size_t size, float* c) {
  constexpr std::size_t kRows = 4, kVectors = 16 / kLanes;
  const Floats d;
  for (std::size_t i = 0; i < size; i += kRows) {
    for (std::size_t j = 0; j < size; j += kVectors * kLanes) {
      hn::Vec<Floats> sums[kRows][kVectors];
      for (auto& row : sums)
        for (auto& sum : row) sum = hn::Zero(d);
      for (std::size_t k = 0; k < count; ++k) {
        hn::Vec<Floats> right[kVectors];
        for (std::size_t v = 0; v < kVectors; ++v) right[v] = hn::LoadU(d, b + k * size + j + v * kLanes);
        for (std::size_t r = 0; r < kRows; ++r) {
          const auto left = hn::Set(d, a[k * size + i + r]);
          for (std::size_t v = 0; v < kVectors; ++v) sums[r][v] = hn::MulAdd(left, right[v], sums[r][v]);
        }
      }
      for (std::size_t r = 0; r < kRows; ++r) {
        for (std::size_t v = 0; v < kVectors; ++v) {
          float* out = c + (i + r) * size + j + v * kLanes;
          hn::StoreU(hn::Add(hn::LoadU(d, out), sums[r][v]), d, out);
        }
      }
    }
  }
}

/// Sums the facets for one pair of directions: each of eight sums takes every eighth facet.
template <std::size_t kChannels>
HWY_INLINE void sumGgxPair(const FacetArrays& facets, const float* colors, std::size_t color_stride, Vec3 h, const float* row_i,
                           const float* row_o, float* totals) {
  constexpr std::size_t kVectors = kSums / kLanes;
  const Floats d;
  const auto hx = hn::Set(d, h.x), hy = hn::Set(d, h.y), hz = hn::Set(d, h.z), one = hn::Set(d, 1.0f);
  hn::Vec<Floats> sums[kChannels][kVectors];
  for (auto& channel : sums)
    for (auto& sum : channel) sum = hn::Zero(d);
  for (std::size_t k = 0; k < facets.count; k += kSums) {
    for (std::size_t v = 0; v < kVectors; ++v) {
      const std::size_t f = k + v * kLanes;
      const auto in_plane = hn::MulAdd(hn::LoadU(d, facets.x + f), hx, hn::Mul(hn::LoadU(d, facets.y + f), hy));
      const auto cosine = hn::MulAdd(hn::LoadU(d, facets.z + f), hz, in_plane);
      const auto t = hn::MulAdd(hn::Mul(hn::LoadU(d, facets.bend + f), cosine), cosine, one);
      const auto value = hn::Div(hn::Mul(hn::LoadU(d, row_i + f), hn::LoadU(d, row_o + f)), hn::Mul(t, t));
      if constexpr (kChannels == 1) {
        sums[0][v] = hn::Add(sums[0][v], value);
      } else {
        for (std::size_t c = 0; c < kChannels; ++c)
          sums[c][v] = hn::MulAdd(hn::LoadU(d, colors + c * color_stride + f), value, sums[c][v]);
      }
    }
  }
  HWY_ALIGN float lanes[kSums];
  for (std::size_t c = 0; c < kChannels; ++c) {
    for (std::size_t v = 0; v < kVectors; ++v) hn::Store(sums[c][v], d, lanes + v * kLanes);
    totals[c] = 0;
    for (const float lane : lanes) totals[c] += lane;
  }
}

void AddGgxPairs(const FacetArrays& facets, std::span<const Vec3> half, std::size_t directions, std::size_t stride, float* c) {
  for (std::size_t i = 0; i < directions; ++i) {
    for (std::size_t o = i; o < directions; ++o) {
      float total;
      sumGgxPair<1>(facets, nullptr, 0, half[i * directions + o], facets.masked + i * facets.count,
                    facets.masked + o * facets.count, &total);
      c[i * stride + o] += total;
    }
  }
}

void AddColoredGgxPairs(const FacetArrays& facets, const float* colors, std::size_t color_stride, std::span<const Vec3> half,
                        std::size_t directions, std::size_t stride, float* c) {
  for (std::size_t i = 0; i < directions; ++i) {
    for (std::size_t o = i; o < directions; ++o) {
      float totals[3];
      sumGgxPair<3>(facets, colors, color_stride, half[i * directions + o], facets.masked + i * facets.count,
                    facets.masked + o * facets.count, totals);
      for (std::size_t channel = 0; channel < 3; ++channel) c[(channel * stride + i) * stride + o] += totals[channel];
    }
  }
}

/// A plain loop, of which the compiler makes vectors.
void AddGgxLights(const DirectionTable& directions, const float* visible, Vec3 normal, Vec3 view, const BaseBrdf& base,
                  float scale, float* out) {
  const float *x = directions.x.data(), *y = directions.y.data(), *z = directions.z.data();
  const float a2 = base.alpha * base.alpha;
  const float cosine_view = std::max(1e-4f, normal.x * view.x + normal.y * view.y + normal.z * view.z);
  const float factor = scale * a2 / (4 * std::numbers::pi_v<float> * cosine_view) * ggxMasking(cosine_view, base.alpha);
  const bool mirror = base.eta == 1 && base.k == 0;
  const std::size_t count = directions.padded;
  for (std::size_t d = 0; d < count; ++d) {
    const float ci = std::max(0.0f, x[d] * normal.x + y[d] * normal.y + z[d] * normal.z);
    const float squared = std::max(1e-6f, 2 + 2 * (x[d] * view.x + y[d] * view.y + z[d] * view.z));
    const float ch = ci + cosine_view;
    // t is at least alpha^2 for directions in front of the facet. Behind the facet, where the result is 0, `ch` is no cosine:
    // the bound keeps 0 / 0 away.
    const float t = std::max(a2, 1 + (a2 - 1) * ch * ch / squared);
    const float masking = 2 * ci / (ci + std::sqrt(a2 + (1 - a2) * ci * ci));
    out[d] +=
        factor * visible[d] * masking / (t * t) * (mirror ? 1 : conductorFresnel(0.5f * std::sqrt(squared), base.eta, base.k));
  }
}

}  // namespace glint::bake::HWY_NAMESPACE
HWY_AFTER_NAMESPACE();

#if HWY_ONCE
namespace glint::bake {

HWY_EXPORT(MultiplyCosines);
HWY_EXPORT(AddProducts);
HWY_EXPORT(AddGgxPairs);
HWY_EXPORT(AddColoredGgxPairs);
HWY_EXPORT(AddGgxLights);

DirectionTable::DirectionTable(std::span<const Vec3> directions)
    : count(directions.size()), padded((directions.size() + 15) / 16 * 16), x(padded), y(padded), z(padded) {
  for (std::size_t d = 0; d < count; ++d) x[d] = directions[d].x, y[d] = directions[d].y, z[d] = directions[d].z;
}

void multiplyCosines(const DirectionTable& directions, Vec3 normal, float* row) {
  HWY_DYNAMIC_DISPATCH(MultiplyCosines)(directions, normal, row);
}

void addProducts(const float* a, const float* b, std::size_t count, std::size_t size, float* c) {
  HWY_DYNAMIC_DISPATCH(AddProducts)(a, b, count, size, c);
}

void addGgxPairs(const FacetArrays& facets, std::span<const Vec3> half, std::size_t directions, std::size_t stride, float* c) {
  HWY_DYNAMIC_DISPATCH(AddGgxPairs)(facets, half, directions, stride, c);
}

void addColoredGgxPairs(const FacetArrays& facets, const float* colors, std::size_t color_stride, std::span<const Vec3> half,
                        std::size_t directions, std::size_t stride, float* c) {
  HWY_DYNAMIC_DISPATCH(AddColoredGgxPairs)(facets, colors, color_stride, half, directions, stride, c);
}

void addGgxLights(const DirectionTable& directions, const float* visible, Vec3 normal, Vec3 view, const BaseBrdf& base,
                  float scale, float* out) {
  HWY_DYNAMIC_DISPATCH(AddGgxLights)(directions, visible, normal, view, base, scale, out);
}

}  // namespace glint::bake
#endif
