#include "glint/bake/compressed/encode.h"

#include <Eigen/Cholesky>
#include <algorithm>
#include <cmath>
#include <cstdint>
#include <cstring>
#include <limits>

#include "glint/bake/compressed/kernels.h"
#include "glint/bake/compressed/quantize.h"
#include "glint/query/detail/pyramid/block_mass.h"

namespace glint::bake {
namespace {

// Largest integer of a quantised basis. 12 bits with the sign, so that the prefix sums of 16 integers fit 16 bits.
constexpr float kBasisPeak = 2047;

// Ridge of the least squares for coefficients, relative to the mean square norm of a basis image. Without it, nearly parallel
// columns of cp would get large coefficients of opposite signs, whose quantisation costs more accuracy than the ridge does.
constexpr double kCpRidge = 1e-3;
constexpr double kOrthogonalRidge = 1e-9;

template <class T>
void append(std::vector<std::byte>& bytes, T value) {
  const std::size_t size = bytes.size();
  bytes.resize(size + sizeof(T));
  std::memcpy(bytes.data() + size, &value, sizeof(T));
}

/// Quantised functions of a basis: along one axis, or images.
struct QuantizedFactor {
  std::vector<float> values;  // [rows][columns]: integers, or for f32 numbers up to 1
  std::vector<float> scales;  // [columns]: value = scale * stored
};

/// Scales each column so that its largest magnitude is kBasisPeak and rounds it to integers, or for f32 scales it to 1.
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

/// Writes the prefix sums of [16][columns] along the first axis as elements of type T, and replaces the values by the
/// differences of these sums, as a reader decodes them.
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

/// Writes the sums of images [16][16][columns] over the pixels below and left of each pixel, and replaces the values by the
/// differences of these sums, as a reader decodes them.
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

/// Quantised basis images, as a reader decodes them, and the matrix that gives their coefficients for a slice.
struct DecodedBasis {
  int columns = 0;
  int stride = 0;             // columns with padding
  std::vector<float> images;  // [columns][256]
  std::vector<float> dual;    // [256][stride]: coefficients = slice * dual
  std::vector<float> scales;  // [columns]: value of a stored 1
};

/// Appends the basis image x_a(x) y_b(y).
void appendProduct(const QuantizedFactor& x, int rank_x, int a, const QuantizedFactor& y, int rank_y, int b,
                   DecodedBasis& out) {
  const float scale = x.scales[a] * y.scales[b];
  out.scales.push_back(scale);
  for (int j = 0; j < kBlockSize; ++j)
    for (int i = 0; i < kBlockSize; ++i) out.images.push_back(scale * x.values[i * rank_x + a] * y.values[j * rank_y + b]);
}

/// Computes dual = images^T (images images^T + ridge)^-1: regularised least squares for the coefficients of any slice.
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

/// Quantises the basis, writes it to `bytes`, and decodes it again.
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
    const int rank_y = basis.rank_y;
    QuantizedFactor x = quantizeFactor(basis.x, kBlockSize, basis.rank_x, integers);
    QuantizedFactor y = quantizeFactor(basis.y, kBlockSize, rank_y, integers);
    integers ? writePrefixSums<std::int16_t>(x.values, basis.rank_x, bytes)
             : writePrefixSums<float>(x.values, basis.rank_x, bytes);
    integers ? writePrefixSums<std::int16_t>(y.values, rank_y, bytes) : writePrefixSums<float>(y.values, rank_y, bytes);
    for (const ClusterColumn& column : basis.columns) {
      const bool tucker = method == CompressionMethod::tucker;
      appendProduct(x, basis.rank_x, tucker ? column.index % kBlockSize : column.index, y, rank_y,
                    tucker ? column.index / kBlockSize : column.index, out);
    }
  }
  out.columns = static_cast<int>(out.scales.size());
  solveDual(out, method == CompressionMethod::cp ? kCpRidge : kOrthogonalRidge);
  return out;
}

/// Solves the coefficients of all slices, [slices][stride].
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

/// Chooses the step of each column. Coefficients of i8 are multiples of the step; of f16 and f32 they are divided by it, and
/// the step is the largest magnitude.
std::vector<float> columnSteps(const std::vector<float>& coefficients, int count, int stride,
                               const std::vector<ClusterColumn>& columns, CoefficientType type) {
  std::vector<float> steps(columns.size(), 0.0f);
  for (std::size_t k = 0; k < columns.size(); ++k) {
    if (type == CoefficientType::i8 && columns[k].bits == 4) {
      steps[k] = narrowStep(coefficients.data() + k, count, stride);
      continue;
    }
    for (int s = 0; s < count; ++s)
      steps[k] = std::max(steps[k], std::abs(coefficients[static_cast<std::size_t>(s) * stride + k]));
    if (type == CoefficientType::i8) steps[k] /= kWidePeak;
  }
  return steps;
}

/// Rounds the coefficients to `type`, writes them row by row, and replaces them by the values that a reader decodes.
/// @return value of a stored 1, of each column
std::vector<float> quantizeCoefficients(std::vector<float>& coefficients, int count, int stride,
                                        const std::vector<ClusterColumn>& columns, CoefficientType type,
                                        std::vector<std::byte>& bytes) {
  const int all = static_cast<int>(columns.size());
  const auto wide = static_cast<int>(std::count_if(
      columns.begin(), columns.end(), [&](const ClusterColumn& c) { return type != CoefficientType::i8 || c.bits == 8; }));
  const int half = (all - wide + 1) / 2;
  std::vector<float> scales = columnSteps(coefficients, count, stride, columns, type);
  std::vector<float> inverses(columns.size(), 0.0f);
  for (int k = 0; k < all; ++k) {
    if (scales[k] > 0) inverses[k] = 1 / scales[k];
    // A step too small for a float to invert makes a column of zeros.
    if (!std::isfinite(inverses[k])) inverses[k] = scales[k] = 0;
  }
  std::vector<int> halves(2 * static_cast<std::size_t>(half));
  for (int s = 0; s < count; ++s) {
    for (int k = 0; k < all; ++k) {
      float& value = coefficients[static_cast<std::size_t>(s) * stride + k];
      float stored = value * inverses[k];
      if (type == CoefficientType::i8) {
        const float peak = k < wide ? kWidePeak : kNarrowPeak;
        stored = std::clamp(std::round(stored), -peak, peak);
        if (k < wide)
          append(bytes, static_cast<std::int8_t>(stored));
        else
          halves[k - wide] = static_cast<int>(stored);
      } else if (type == CoefficientType::f16) {
        const Eigen::half rounded(stored);
        append(bytes, rounded.x);
        stored = static_cast<float>(rounded);
      } else {
        append(bytes, stored);
      }
      value = stored * scales[k];
    }
    // Two coefficients of 4 bits share a byte: those of the first and of the second half of the narrow columns.
    for (int j = 0; j < half; ++j) append(bytes, static_cast<std::uint8_t>((halves[j] & 15) | halves[half + j] << 4));
  }
  return scales;
}

/// Compares a slice with its decoded form.
SliceError compare(const float* slice, const float* decoded) {
  SliceError r;
  for (int p = 0; p < kBlockPixels; ++p) {
    const float d = decoded[p];
    const float e = slice[p] - d;
    r.error += e * e;
    r.cross += e * d;
    r.power += d * d;
    r.sum += d;
    r.positive += std::max(0.0f, d);
  }
  return r;
}

/// Decodes every slice and compares it with the original. A basis without columns decodes to zeros.
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
      result[first + s] = compare(panel.data() + s * kSliceStride, decoded.data() + s * kSliceStride);
    }
  }
  return result;
}

/// Density of the rest of a slice, >= 0: the mass that its spots leave, spread evenly over the block.
float restOf(const float* slice, const SliceSpots& spots, const SpotFinder& finder) {
  float sum = 0;
  for (int p = 0; p < kBlockPixels; ++p) sum += slice[p];
  for (const Spot& spot : spots) sum -= spot.weight * finder.share(spot);
  return std::max(0.0f, sum / kBlockPixels);
}

/// The code (see blockMassCode) whose mass is nearest.
std::uint8_t nearestMassCode(float mass) {
  const std::uint8_t above = blockMassCode(mass);
  return above > 0 && mass - blockMass(above - 1) < blockMass(above) - mass ? above - 1 : above;
}

/// Quantises a cluster of spots, writes it as ndf_cp.h says, and compares its decoded slices with the originals.
void encodeSpots(const SliceIndex& index, std::size_t cluster, float peak, const std::vector<SliceSpots>& spots,
                 EncodedCluster& out) {
  // Find the largest weight and rest of all slices, which give the scales.
  const SpotFinder finder(index.sigmaPixels());
  const auto all = static_cast<std::uint32_t>(spots.size());
  std::vector<float> slice(kSliceStride), decoded(kBlockPixels), rests;
  float most_weight = 0, most_rest = 0;
  for (std::uint32_t s = 0; s < all; ++s) {
    index.load(cluster, static_cast<int>(s), 1, 1 / peak, slice.data());
    rests.push_back(restOf(slice.data(), spots[s], finder));
    most_rest = std::max(most_rest, rests.back());
    for (const Spot& spot : spots[s]) most_weight = std::max(most_weight, spot.weight);
  }
  out.scales = {most_weight / 65535, most_rest};
  // Keep the slices that have a rest or spots.
  std::vector<std::uint8_t> codes(all);
  for (std::uint32_t s = 0; s < all; ++s) {
    codes[s] = most_rest > 0 ? nearestMassCode(rests[s] / most_rest) : 0;
    if (codes[s] > 0 || !spots[s].empty()) out.kept.push_back(s);
  }
  // Write the index of spots: a running count for each group of slices, and count and rest of each slice.
  const auto count = static_cast<std::uint32_t>(out.kept.size());
  out.coefficients.assign(firstSpotOffset(count), std::byte{0});
  for (std::uint32_t k = 0; k < count; ++k) {
    const auto before = static_cast<std::uint32_t>(out.spots);
    if (k % kSpotGroup == 0) std::memcpy(out.coefficients.data() + 4 * (k / kSpotGroup), &before, sizeof before);
    out.coefficients[spotCountsOffset(count) + k] = static_cast<std::byte>(spots[out.kept[k]].size());
    out.coefficients[spotCountsOffset(count) + count + k] = static_cast<std::byte>(codes[out.kept[k]]);
    out.spots += spots[out.kept[k]].size();
  }
  // Write the spots, and decode every slice as a reader does.
  for (std::uint32_t s = 0; s < all; ++s) {
    index.load(cluster, static_cast<int>(s), 1, 1 / peak, slice.data());
    std::fill(decoded.begin(), decoded.end(), most_rest * blockMass(codes[s]));
    for (const Spot& spot : spots[s]) {
      const float weight = std::clamp(std::round(spot.weight / out.scales[0]), 0.0f, 65535.0f);
      append(out.coefficients, NdfSpot{spot.x, spot.y, static_cast<std::uint16_t>(weight)});
      finder.add(spot.x, spot.y, out.scales[0] * weight, decoded.data());
    }
    out.slices.push_back(compare(slice.data(), decoded.data()));
  }
}

/// Slices that are worth storing: they hold at least the energy `least`, or more than a 256th of the mass of their image.
std::vector<std::uint32_t> worthyRows(const SliceIndex& index, std::size_t cluster, float peak, float unit, double least) {
  constexpr double kMostOfImage = 1.0 / 256;
  const double pixel_area = 1.0 / index.pixelsPerArea();
  std::vector<std::uint32_t> kept;
  std::vector<float> slice(kSliceStride);
  for (int s = 0; s < index.sliceCount(cluster); ++s) {
    double energy = 0, sum = 0;
    if (least > 0) {
      index.load(cluster, s, 1, 1 / peak, slice.data());
      for (int p = 0; p < kBlockPixels; ++p) {
        energy += static_cast<double>(slice[p]) * slice[p];
        sum += slice[p];
      }
    }
    if (energy * peak * peak >= least || sum * peak * unit * pixel_area > kMostOfImage)
      kept.push_back(static_cast<std::uint32_t>(s));
  }
  return kept;
}

/// Moves the rows of kept slices to the front.
void keepRows(const std::vector<std::uint32_t>& kept, int stride, std::vector<float>& rows) {
  for (std::size_t k = 0; k < kept.size(); ++k)
    std::copy_n(rows.begin() + static_cast<std::ptrdiff_t>(kept[k]) * stride, stride,
                rows.begin() + static_cast<std::ptrdiff_t>(k) * stride);
}

/// Moves the rows of kept slices back to where keepRows() took them from, and clears all other rows.
void spreadRows(const std::vector<std::uint32_t>& kept, int count, int stride, std::vector<float>& rows) {
  std::vector<float> all(static_cast<std::size_t>(count) * stride, 0.0f);
  for (std::size_t k = 0; k < kept.size(); ++k)
    std::copy_n(rows.begin() + static_cast<std::ptrdiff_t>(k) * stride, stride,
                all.begin() + static_cast<std::ptrdiff_t>(kept[k]) * stride);
  rows = std::move(all);
}

}  // namespace

EncodedCluster encodeCluster(const SliceIndex& index, std::size_t cluster, const ClusterStatistics& statistics,
                             const ClusterBasis& basis, CompressionMethod method, CoefficientType type, float unit,
                             double per_byte) {
  // Spots, and clusters of nothing, have no columns.
  EncodedCluster out;
  const int count = index.sliceCount(cluster);
  if (!basis.spots.empty()) {
    encodeSpots(index, cluster, statistics.peak, basis.spots, out);
    if (method == CompressionMethod::tucker) out.core.resize(out.scales.size());
    for (float& scale : out.scales) scale *= statistics.peak * unit;
    return out;
  }
  if (basis.columns.empty()) {
    out.slices = measureSlices(index, cluster, std::max(statistics.peak, std::numeric_limits<float>::min()), {}, {});
    return out;
  }
  // Quantise the basis, and solve the coefficients of every slice for it.
  out.columns = static_cast<int>(basis.columns.size());
  if (method == CompressionMethod::tucker) {
    out.rank_x = basis.rank_x;
    out.rank_y = basis.rank_y;
    for (const ClusterColumn& column : basis.columns) out.core.push_back(static_cast<std::uint8_t>(column.index));
  }
  if (type == CoefficientType::i8)
    for (const ClusterColumn& column : basis.columns) out.narrow_columns += column.bits == 4;
  const DecodedBasis decoded = encodeBasis(basis, method, type, out.basis);
  std::vector<float> coefficients = solveCoefficients(index, cluster, statistics.peak, decoded);
  // Leave out slices that are not worth their bytes, and quantise the coefficients of all others.
  const double row_bytes =
      type == CoefficientType::i8 ? out.columns - 0.5 * out.narrow_columns : 1.0 * out.columns * coefficientElementBytes(type);
  out.kept = worthyRows(index, cluster, statistics.peak, unit, (row_bytes + 1) * per_byte);
  keepRows(out.kept, decoded.stride, coefficients);
  out.scales = quantizeCoefficients(coefficients, static_cast<int>(out.kept.size()), decoded.stride, basis.columns, type,
                                    out.coefficients);
  for (int k = 0; k < decoded.columns; ++k) out.scales[k] *= decoded.scales[k] * statistics.peak * unit;
  // Measure the error as a reader sees it.
  spreadRows(out.kept, count, decoded.stride, coefficients);
  out.slices = measureSlices(index, cluster, statistics.peak, decoded, coefficients);
  return out;
}

}  // namespace glint::bake
