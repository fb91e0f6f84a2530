#pragma once

#include <algorithm>
#include <cstddef>
#include <cstdint>

#include "glint/model/compressed_ndf.h"
#include "glint/query/half.h"
#include "glint/query/pyramid_slices.h"

namespace glint {

/// Columns of the largest cluster: a block has no more pixels.
inline constexpr int kMaxColumns = kBlockPixels;

inline GLINT_HD int columnCount(const CompressedNdf& ndf, const NdfCluster& cluster) {
  return ndf.method == CompressionMethod::tucker ? cluster.rank_x * cluster.rank_y : cluster.rank_x;
}

/// sums[k] = sum of column k over [low, high] of one block axis, from its inclusive prefix sums [16][columns]. Pixels at the ends
/// count by their covered part.
template <class T>
GLINT_HD void sumAlongAxis(const T* prefix, int columns, float low, float high, float* sums) {
  const int l = std::min(static_cast<int>(low), kBlockSize - 1), h = std::min(static_cast<int>(high), kBlockSize - 1);
  const float fl = low - static_cast<float>(l), fh = high - static_cast<float>(h);
  // Sum up to x = (1 - f) * prefix before its pixel + f * prefix after it.
  const T* l0 = l > 0 ? prefix + (l - 1) * columns : nullptr;
  const T* h0 = h > 0 ? prefix + (h - 1) * columns : nullptr;
  const T* l1 = prefix + l * columns;
  const T* h1 = prefix + h * columns;
  for (int k = 0; k < columns; ++k) {
    const float before = (l0 ? (1 - fl) * static_cast<float>(l0[k]) : 0.0f) + (fl > 0 ? fl * static_cast<float>(l1[k]) : 0.0f);
    const float after = (h0 ? (1 - fh) * static_cast<float>(h0[k]) : 0.0f) + fh * static_cast<float>(h1[k]);
    sums[k] = after - before;
  }
}

/// values[k] = column k at one pixel of a block axis: the difference of neighbouring prefix sums.
template <class T>
GLINT_HD void valueAlongAxis(const T* prefix, int columns, int pixel, float* values) {
  const T* after = prefix + pixel * columns;
  if (pixel == 0) {
    for (int k = 0; k < columns; ++k) values[k] = static_cast<float>(after[k]);
  } else {
    const T* before = after - columns;
    for (int k = 0; k < columns; ++k) values[k] = static_cast<float>(after[k] - before[k]);
  }
}

/// sums[k] += weight * sum of image k over [0, x] x [0, y], from its 2D prefix sums [16][16][columns]: bilinear between them.
template <class T>
GLINT_HD void addCorner(const T* prefix, int columns, float x, float y, float weight, float* sums) {
  const int px = std::min(static_cast<int>(x), kBlockSize - 1), py = std::min(static_cast<int>(y), kBlockSize - 1);
  const float fx = x - static_cast<float>(px), fy = y - static_cast<float>(py);
  for (int corner = 0; corner < 4; ++corner) {
    const int cx = px - 1 + (corner & 1), cy = py - 1 + (corner >> 1);
    const float w = weight * (corner & 1 ? fx : 1 - fx) * (corner & 2 ? fy : 1 - fy);
    if (w == 0 || cx < 0 || cy < 0) continue;
    const T* row = prefix + (cy * kBlockSize + cx) * columns;
    for (int k = 0; k < columns; ++k) sums[k] += w * static_cast<float>(row[k]);
  }
}

/// values[k] = image k at one pixel.
template <class T>
GLINT_HD void valueOfImage(const T* prefix, int columns, int x, int y, float* values) {
  const T* at = prefix + (y * kBlockSize + x) * columns;
  const T* left = x > 0 ? at - columns : nullptr;
  const T* below = y > 0 ? at - kBlockSize * columns : nullptr;
  const T* corner = x > 0 && y > 0 ? below - columns : nullptr;
  for (int k = 0; k < columns; ++k) {
    T v = at[k];
    if (left) v -= left[k];
    if (below) v -= below[k];
    if (corner) v += corner[k];
    values[k] = static_cast<float>(v);
  }
}

/// Sums over a part of a block of every basis image of a cluster, scaled: density = dotProduct(projection, coefficients of a slice).
template <class T>
struct BasisProjector {
  const CompressedNdf& ndf;

  GLINT_HD int pixel(const NdfCluster& cluster, int x, int y, float* projection) const {
    const T* basis = static_cast<const T*>(ndf.basis) + cluster.first_basis;
    if (ndf.method == CompressionMethod::pca) {
      valueOfImage(basis, cluster.rank_x, x, y, projection);
      return scale(cluster, cluster.rank_x, projection);
    }
    const int ry = ndf.method == CompressionMethod::cp ? cluster.rank_x : cluster.rank_y;
    float along_x[kMaxColumns], along_y[kMaxColumns];
    valueAlongAxis(basis, cluster.rank_x, x, along_x);
    valueAlongAxis(basis + kBlockSize * cluster.rank_x, ry, y, along_y);
    return combine(cluster, along_x, along_y, projection);
  }

  GLINT_HD int box(const NdfCluster& cluster, const BlockBox& b, float* projection) const {
    const T* basis = static_cast<const T*>(ndf.basis) + cluster.first_basis;
    if (ndf.method == CompressionMethod::pca) {
      const int columns = cluster.rank_x;
      std::fill(projection, projection + columns, 0.0f);
      addCorner(basis, columns, b.x1, b.y1, 1, projection);
      addCorner(basis, columns, b.x0, b.y1, -1, projection);
      addCorner(basis, columns, b.x1, b.y0, -1, projection);
      addCorner(basis, columns, b.x0, b.y0, 1, projection);
      return scale(cluster, columns, projection);
    }
    const int ry = ndf.method == CompressionMethod::cp ? cluster.rank_x : cluster.rank_y;
    float along_x[kMaxColumns], along_y[kMaxColumns];
    sumAlongAxis(basis, cluster.rank_x, b.x0, b.x1, along_x);
    sumAlongAxis(basis + kBlockSize * cluster.rank_x, ry, b.y0, b.y1, along_y);
    return combine(cluster, along_x, along_y, projection);
  }

 private:
  GLINT_HD int combine(const NdfCluster& cluster, const float* x, const float* y, float* projection) const {
    if (ndf.method == CompressionMethod::cp) {
      for (int k = 0; k < cluster.rank_x; ++k) projection[k] = x[k] * y[k];
      return scale(cluster, cluster.rank_x, projection);
    }
    for (int a = 0; a < cluster.rank_x; ++a)
      for (int b = 0; b < cluster.rank_y; ++b) projection[a * cluster.rank_y + b] = x[a] * y[b];
    return scale(cluster, cluster.rank_x * cluster.rank_y, projection);
  }

  GLINT_HD int scale(const NdfCluster& cluster, int columns, float* projection) const {
    const float* scales = ndf.scales.data() + cluster.first_scale;
    for (int k = 0; k < columns; ++k) projection[k] *= scales[k];
    return columns;
  }
};

/// Runs a visitor with the projector of the element type that a compressed NDF stores: f32, i16 (cp, tucker) or i32 (pca).
template <class Visitor>
GLINT_HD int withProjector(const CompressedNdf& ndf, Visitor&& visitor) {
  if (ndf.coefficient_type == CoefficientType::f32) return visitor(BasisProjector<float>{ndf});
  if (ndf.method == CompressionMethod::pca) return visitor(BasisProjector<std::int32_t>{ndf});
  return visitor(BasisProjector<std::int16_t>{ndf});
}

/// blend[k] += weight * coefficient k of the slice that starts at element `first`.
inline GLINT_HD void addCoefficients(const CompressedNdf& ndf, std::uint64_t first, float weight, int columns, float* blend) {
  switch (ndf.coefficient_type) {
    case CoefficientType::i8: {
      const auto* c = static_cast<const std::int8_t*>(ndf.coefficients) + first;
      for (int k = 0; k < columns; ++k) blend[k] += weight * static_cast<float>(c[k]);
      break;
    }
    case CoefficientType::f16: {
      const auto* c = static_cast<const std::uint16_t*>(ndf.coefficients) + first;
      for (int k = 0; k < columns; ++k) blend[k] += weight * halfToFloat(c[k]);
      break;
    }
    case CoefficientType::f32: {
      const auto* c = static_cast<const float*>(ndf.coefficients) + first;
      for (int k = 0; k < columns; ++k) blend[k] += weight * c[k];
      break;
    }
  }
}

/// Dot product of a projection with blended coefficients, in four sums side by side: one would wait for each addition.
inline GLINT_HD float dotProduct(const float* a, const float* b, int columns) {
  float sums[4] = {};
  int k = 0;
  for (; k + 4 <= columns; k += 4)
    for (int lane = 0; lane < 4; ++lane) sums[lane] += a[k + lane] * b[k + lane];
  float sum = (sums[0] + sums[2]) + (sums[1] + sums[3]);
  for (; k < columns; ++k) sum += a[k] * b[k];
  return sum;
}

}  // namespace glint
