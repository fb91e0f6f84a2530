#include "glint/bake/displace/effective_kernels.h"

#include <algorithm>
#include <cmath>
#include <cstring>
#include <numbers>

#include "glint/bake/common/simd.h"
#include "glint/query/brdf/base_brdf.h"

namespace glint::bake {
namespace {

// The compiler may not reorder a sum, so it makes no vectors of a plain loop that sums. With eight lanes written out, each lane
// sums every eighth term.
using Lanes = float __attribute__((vector_size(32)));

inline void load(const float* from, Lanes& to) { std::memcpy(&to, from, sizeof to); }

}  // namespace

DirectionTable::DirectionTable(std::span<const Vec3> directions)
    : count(directions.size()), padded((directions.size() + 15) / 16 * 16), x(padded), y(padded), z(padded) {
  for (std::size_t d = 0; d < count; ++d) x[d] = directions[d].x, y[d] = directions[d].y, z[d] = directions[d].z;
}

GLINT_MULTIVERSION void multiplyCosines(const DirectionTable& directions, Vec3 normal, float* row) {
  const float *x = directions.x.data(), *y = directions.y.data(), *z = directions.z.data();
  const std::size_t count = directions.padded;
  for (std::size_t d = 0; d < count; ++d) row[d] *= std::max(0.0f, x[d] * normal.x + y[d] * normal.y + z[d] * normal.z);
}

GLINT_MULTIVERSION void addProducts(const float* a, const float* b, std::size_t count, std::size_t size, float* c) {
  for (std::size_t i = 0; i < size; i += 4) {
    for (std::size_t j = 0; j < size; j += 16) {
      Lanes sum[4][2] = {};
      for (std::size_t k = 0; k < count; ++k) {
        Lanes left, right;
        load(b + k * size + j, left);
        load(b + k * size + j + 8, right);
        const float* column = a + k * size + i;
        sum[0][0] += column[0] * left, sum[0][1] += column[0] * right;
        sum[1][0] += column[1] * left, sum[1][1] += column[1] * right;
        sum[2][0] += column[2] * left, sum[2][1] += column[2] * right;
        sum[3][0] += column[3] * left, sum[3][1] += column[3] * right;
      }
      for (std::size_t r = 0; r < 4; ++r)
        for (std::size_t l = 0; l < 16; ++l) c[(i + r) * size + j + l] += sum[r][l / 8][l % 8];
    }
  }
}

namespace {

/// Sums the facets for one pair of directions. Inlined, so that each version of a caller has it in its own instructions.
template <std::size_t Channels>
[[gnu::always_inline]] inline void sumGgxPair(const FacetArrays& facets, const float* colors, std::size_t color_stride, Vec3 h,
                                              const float* row_i, const float* row_o, float* totals) {
  Lanes sums[Channels] = {};
  for (std::size_t k = 0; k < facets.count; k += 8) {
    Lanes x, y, z, bend, gi, go;
    load(facets.x + k, x), load(facets.y + k, y), load(facets.z + k, z), load(facets.bend + k, bend);
    load(row_i + k, gi), load(row_o + k, go);
    const Lanes cosine = x * h.x + y * h.y + z * h.z;
    const Lanes t = 1 + bend * cosine * cosine;
    const Lanes value = gi * go / (t * t);
    if constexpr (Channels == 1) {
      sums[0] += value;
    } else {
      for (std::size_t c = 0; c < Channels; ++c) {
        Lanes color;
        load(colors + c * color_stride + k, color);
        sums[c] += color * value;
      }
    }
  }
  for (std::size_t c = 0; c < Channels; ++c) {
    totals[c] = 0;
    for (int l = 0; l < 8; ++l) totals[c] += sums[c][l];
  }
}

}  // namespace

GLINT_MULTIVERSION void addGgxPairs(const FacetArrays& facets, std::span<const Vec3> half, std::size_t directions,
                                    std::size_t stride, float* c) {
  for (std::size_t i = 0; i < directions; ++i) {
    for (std::size_t o = i; o < directions; ++o) {
      float total;
      sumGgxPair<1>(facets, nullptr, 0, half[i * directions + o], facets.masked + i * facets.count,
                    facets.masked + o * facets.count, &total);
      c[i * stride + o] += total;
    }
  }
}

GLINT_MULTIVERSION void addColoredGgxPairs(const FacetArrays& facets, const float* colors, std::size_t color_stride,
                                           std::span<const Vec3> half, std::size_t directions, std::size_t stride, float* c) {
  for (std::size_t i = 0; i < directions; ++i) {
    for (std::size_t o = i; o < directions; ++o) {
      float totals[3];
      sumGgxPair<3>(facets, colors, color_stride, half[i * directions + o], facets.masked + i * facets.count,
                    facets.masked + o * facets.count, totals);
      for (std::size_t channel = 0; channel < 3; ++channel) c[(channel * stride + i) * stride + o] += totals[channel];
    }
  }
}

GLINT_MULTIVERSION void addGgxLights(const DirectionTable& directions, const float* visible, Vec3 normal, Vec3 view,
                                     const BaseBrdf& base, float scale, float* out) {
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

}  // namespace glint::bake
