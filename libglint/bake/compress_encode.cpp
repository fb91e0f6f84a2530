#include "glint/bake/compress_encode.h"

#include <Eigen/Cholesky>
#include <algorithm>
#include <cmath>
#include <cstdint>
#include <cstring>
#include <limits>

#include "glint/bake/compress_kernels.h"

namespace glint::bake {
namespace {

// Largest integer of a quantised basis: 12 bits with the sign, so that 16 of them sum to less than 2^15.
constexpr float kBasisPeak = 2047;

// Largest coefficient of a column of i8.
constexpr float kCoefficientPeak = 127;

// Ridge of the coefficients, relative to the mean square norm of a basis image. Nearly parallel columns of cp would otherwise
// get large coefficients of opposite signs, and lose more in quantisation than the ridge costs.
constexpr double kCpRidge = 1e-3;
constexpr double kOrthogonalRidge = 1e-9;

template <class T>
void append(std::vector<std::byte>& bytes, T value) {
  const std::size_t size = bytes.size();
  bytes.resize(size + sizeof(T));
  std::memcpy(bytes.data() + size, &value, sizeof(T));
}

/// Values of a basis along one axis, or over both, as the reader sees them.
struct QuantizedFactor {
  std::vector<float> values;  // [rows][columns]: of the size of the input
  std::vector<float> scales;  // [columns]: value = scale * stored
};

/// Rounds each column to integers with the largest at kBasisPeak, or for f32 divides it by its largest value.
QuantizedFactor quantizeFactor(const std::vector<float>& factor, int rows, int columns, bool integers) {
  QuantizedFactor result{factor, std::vector<float>(columns, 0.0f)};
  for (int k = 0; k < columns; ++k) {
    float peak = 0;
    for (int i = 0; i < rows; ++i) peak = std::max(peak, std::abs(factor[i * columns + k]));
    if (!(peak > 0)) continue;
    const float scale = integers ? peak / kBasisPeak : peak;
    result.scales[k] = scale;
    for (int i = 0; i < rows; ++i) {
      const float value = factor[i * columns + k] / scale;
      result.values[i * columns + k] = integers ? std::round(value) : value;
    }
  }
  return result;
}

/// Writes the prefix sums of [lines][16][columns] along the middle axis as elements of type T, and replaces the values by the
/// differences that a reader gets.
template <class T>
void writePrefixSums(std::vector<float>& values, int columns, std::vector<std::byte>& bytes) {
  std::vector<double> sums(columns, 0.0);
  std::vector<float> before(columns, 0.0f);
  for (int i = 0; i < kBlockSize; ++i) {
    for (int k = 0; k < columns; ++k) {
      sums[k] += values[i * columns + k];
      const T stored = static_cast<T>(sums[k]);
      append(bytes, stored);
      values[i * columns + k] = static_cast<float>(stored) - before[k];
      before[k] = static_cast<float>(stored);
    }
  }
}

/// The same for images [16][16][columns], summed over both axes.
template <class T>
void writeAreaSums(std::vector<float>& values, int columns, std::vector<std::byte>& bytes) {
  std::vector<double> above(static_cast<std::size_t>(kBlockSize) * columns, 0.0);
  std::vector<float> stored_above(static_cast<std::size_t>(kBlockSize) * columns, 0.0f);
  for (int y = 0; y < kBlockSize; ++y) {
    std::vector<double> row(columns, 0.0);
    std::vector<float> left(columns, 0.0f);
    std::vector<float> diagonal(columns, 0.0f);
    for (int x = 0; x < kBlockSize; ++x) {
      for (int k = 0; k < columns; ++k) {
        float& value = values[(y * kBlockSize + x) * columns + k];
        const int i = x * columns + k;
        row[k] += value;
        above[i] += row[k];
        const T stored = static_cast<T>(above[i]);
        append(bytes, stored);
        const float sum = static_cast<float>(stored);
        value = (sum - left[k]) - (stored_above[i] - diagonal[k]);
        diagonal[k] = stored_above[i];
        left[k] = sum;
        stored_above[i] = sum;
      }
    }
  }
}

/// Quantised basis images and what solves for their coefficients.
struct DecodedBasis {
  int columns = 0;
  int stride = 0;             // columns, padded
  std::vector<float> images;  // [columns][256]
  std::vector<float> dual;    // [256][stride]: coefficients = slice * dual
  std::vector<float> scales;  // [columns]: of the stored integers
};

/// Basis images from factors: cp pairs columns, tucker combines all.
void combineFactors(const QuantizedFactor& x, const QuantizedFactor& y, int rank_x, int rank_y, bool all_pairs,
                    DecodedBasis& out) {
  for (int a = 0; a < rank_x; ++a) {
    for (int b = all_pairs ? 0 : a; b < (all_pairs ? rank_y : a + 1); ++b) {
      const float scale = x.scales[a] * y.scales[b];
      out.scales.push_back(scale);
      for (int j = 0; j < kBlockSize; ++j)
        for (int i = 0; i < kBlockSize; ++i) out.images.push_back(scale * x.values[i * rank_x + a] * y.values[j * rank_y + b]);
    }
  }
}

/// dual = images^T (images images^T + ridge)^-1, the regularised least squares for all slices at once.
void solveDual(DecodedBasis& basis, double ridge) {
  using Matrix = Eigen::Matrix<double, Eigen::Dynamic, Eigen::Dynamic, Eigen::RowMajor>;
  const Eigen::Map<const Eigen::Matrix<float, Eigen::Dynamic, Eigen::Dynamic, Eigen::RowMajor>> images(
      basis.images.data(), basis.columns, kBlockPixels);
  const Matrix rows = images.cast<double>();
  Matrix gram = rows * rows.transpose();
  // The second term keeps a basis of zeros solvable.
  gram.diagonal().array() += ridge * gram.trace() / basis.columns + 1e-30;
  const Matrix solved = gram.llt().solve(rows);
  basis.stride = paddedColumns(basis.columns);
  basis.dual.assign(static_cast<std::size_t>(kBlockPixels) * basis.stride, 0.0f);
  for (int k = 0; k < basis.columns; ++k)
    for (int p = 0; p < kBlockPixels; ++p) basis.dual[p * basis.stride + k] = static_cast<float>(solved(k, p));
}

/// Writes the basis to `bytes` and decodes it.
DecodedBasis encodeBasis(const ClusterBasis& basis, CompressionMethod method, CoefficientType type,
                         std::vector<std::byte>& bytes) {
  const bool integers = type != CoefficientType::f32;
  DecodedBasis out;
  if (method == CompressionMethod::pca) {
    QuantizedFactor images = quantizeFactor(basis.x, kBlockPixels, basis.rank_x, integers);
    integers ? writeAreaSums<std::int32_t>(images.values, basis.rank_x, bytes)
             : writeAreaSums<float>(images.values, basis.rank_x, bytes);
    out.scales = images.scales;
    for (int k = 0; k < basis.rank_x; ++k)
      for (int p = 0; p < kBlockPixels; ++p) out.images.push_back(images.scales[k] * images.values[p * basis.rank_x + k]);
  } else {
    const bool tucker = method == CompressionMethod::tucker;
    const int rank_y = tucker ? basis.rank_y : basis.rank_x;
    QuantizedFactor x = quantizeFactor(basis.x, kBlockSize, basis.rank_x, integers);
    QuantizedFactor y = quantizeFactor(basis.y, kBlockSize, rank_y, integers);
    integers ? writePrefixSums<std::int16_t>(x.values, basis.rank_x, bytes)
             : writePrefixSums<float>(x.values, basis.rank_x, bytes);
    integers ? writePrefixSums<std::int16_t>(y.values, rank_y, bytes) : writePrefixSums<float>(y.values, rank_y, bytes);
    combineFactors(x, y, basis.rank_x, rank_y, tucker, out);
  }
  out.columns = static_cast<int>(out.scales.size());
  solveDual(out, method == CompressionMethod::cp ? kCpRidge : kOrthogonalRidge);
  return out;
}

/// Coefficients of all slices, [slices][stride].
std::vector<float> solveCoefficients(const SliceIndex& index, std::size_t cluster, float peak, const DecodedBasis& basis) {
  const int count = index.sliceCount(cluster);
  std::vector<float> coefficients(static_cast<std::size_t>(count) * basis.stride);
  std::vector<float> panel(static_cast<std::size_t>(std::min(count, kPanelSlices)) * kSliceStride, 0.0f);
  for (int first = 0; first < count; first += kPanelSlices) {
    const int slices = std::min(kPanelSlices, count - first);
    index.load(cluster, first, slices, 1 / peak, panel.data());
    multiply({panel.data(), kSliceStride, 1}, basis.dual.data(), basis.stride,
             coefficients.data() + static_cast<std::size_t>(first) * basis.stride, basis.stride, slices, basis.stride,
             kBlockPixels);
  }
  return coefficients;
}

/// Rounds the coefficients to `type`, column by column, writes them, and replaces them by what a reader decodes.
/// @return scale of each column
std::vector<float> quantizeCoefficients(std::vector<float>& coefficients, int count, const DecodedBasis& basis,
                                        CoefficientType type, std::vector<std::byte>& bytes) {
  std::vector<float> scales(basis.columns, 0.0f);
  for (int s = 0; s < count; ++s)
    for (int k = 0; k < basis.columns; ++k)
      scales[k] = std::max(scales[k], std::abs(coefficients[static_cast<std::size_t>(s) * basis.stride + k]));
  std::vector<float> inverses(basis.columns, 0.0f);
  for (int k = 0; k < basis.columns; ++k) {
    if (type == CoefficientType::i8) scales[k] /= kCoefficientPeak;
    if (scales[k] > 0) inverses[k] = 1 / scales[k];
    // Smaller than any float can invert: a column of zeros.
    if (!std::isfinite(inverses[k])) inverses[k] = scales[k] = 0;
  }
  bytes.reserve(static_cast<std::size_t>(count) * basis.columns * coefficientElementBytes(type));
  for (int s = 0; s < count; ++s) {
    for (int k = 0; k < basis.columns; ++k) {
      float& value = coefficients[static_cast<std::size_t>(s) * basis.stride + k];
      float stored = value * inverses[k];
      if (type == CoefficientType::i8) {
        stored = std::clamp(std::round(stored), -kCoefficientPeak, kCoefficientPeak);
        append(bytes, static_cast<std::int8_t>(stored));
      } else if (type == CoefficientType::f16) {
        const Eigen::half half(stored);
        append(bytes, half.x);
        stored = static_cast<float>(half);
      } else {
        append(bytes, stored);
      }
      value = stored * scales[k];
    }
  }
  return scales;
}

/// Decodes every slice and compares. A basis without columns decodes to zeros.
std::vector<SliceError> measureSlices(const SliceIndex& index, std::size_t cluster, float peak, const DecodedBasis& basis,
                                      const std::vector<float>& coefficients) {
  const int count = index.sliceCount(cluster);
  std::vector<SliceError> result(count);
  const std::size_t panel_size = static_cast<std::size_t>(std::min(count, kPanelSlices)) * kSliceStride;
  std::vector<float> panel(panel_size, 0.0f);
  std::vector<float> decoded(panel_size, 0.0f);
  for (int first = 0; first < count; first += kPanelSlices) {
    const int slices = std::min(kPanelSlices, count - first);
    index.load(cluster, first, slices, 1 / peak, panel.data());
    multiply({coefficients.data() + static_cast<std::size_t>(first) * basis.stride, basis.stride, 1}, basis.images.data(),
             kBlockPixels, decoded.data(), kSliceStride, slices, kBlockPixels, basis.columns);
    for (int s = 0; s < slices; ++s) {
      SliceError& r = result[first + s];
      for (int p = 0; p < kBlockPixels; ++p) {
        const float d = decoded[s * kSliceStride + p];
        const float e = panel[s * kSliceStride + p] - d;
        r.error += e * e;
        r.cross += e * d;
        r.power += d * d;
        r.sum += d;
        r.positive += std::max(0.0f, d);
      }
    }
  }
  return result;
}

}  // namespace

EncodedCluster encodeCluster(const SliceIndex& index, std::size_t cluster, const ClusterStatistics& statistics,
                             const ClusterBasis& basis, CompressionMethod method, CoefficientType type, float unit) {
  EncodedCluster out;
  out.rank_x = basis.rank_x;
  out.rank_y = basis.rank_y;
  const int count = index.sliceCount(cluster);
  if (basis.rank_x == 0) {
    out.slices = measureSlices(index, cluster, std::max(statistics.peak, std::numeric_limits<float>::min()), {}, {});
    return out;
  }
  const DecodedBasis decoded = encodeBasis(basis, method, type, out.basis);
  std::vector<float> coefficients = solveCoefficients(index, cluster, statistics.peak, decoded);
  out.scales = quantizeCoefficients(coefficients, count, decoded, type, out.coefficients);
  for (int k = 0; k < decoded.columns; ++k) out.scales[k] *= decoded.scales[k] * statistics.peak * unit;
  out.slices = measureSlices(index, cluster, statistics.peak, decoded, coefficients);
  return out;
}

}  // namespace glint::bake
