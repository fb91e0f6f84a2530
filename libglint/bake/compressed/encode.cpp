#include "glint/bake/compressed/encode.h"

#include <Eigen/Cholesky>
#include <algorithm>
#include <cmath>
#include <cstdint>
#include <cstring>

#include "glint/bake/compressed/kernels.h"
#include "glint/bake/compressed/quantize.h"
#include "glint/math/float4.h"
#include "glint/query/detail/pyramid/block_mass.h"

namespace glint::bake {
namespace {

// Largest integer of a quantised basis: sums of 16 integers are exact in floats, and sums of 256 fit 32 bits. A block can hold
// densities that differ by a factor of 10,000, and the smallest need some digits, too.
constexpr float kBasisPeak = 0x1p20f;

// Ridge of the least squares for coefficients, relative to the mean square norm of a basis image. Without it, nearly parallel
// columns of cp would get large coefficients of opposite signs, whose quantisation costs more accuracy than the ridge does.
constexpr double kCpRidge = 1e-3;

template <class T>
void append(std::vector<std::byte>& bytes, T value) {
  const std::size_t size = bytes.size();
  bytes.resize(size + sizeof(T));
  std::memcpy(bytes.data() + size, &value, sizeof(T));
}

/// Quantised functions of a basis: along one axis, or images.
struct QuantizedFactor {
  std::vector<float> values;  // [rows][columns]: integers
  std::vector<float> scales;  // [columns]: value = scale * stored
};

/// Scales each column so that its largest magnitude is kBasisPeak and rounds it to integers.
QuantizedFactor quantizeFactor(const std::vector<float>& factor, int rows, int columns) {
  QuantizedFactor result{factor, std::vector<float>(columns, 0.0f)};
  for (int k = 0; k < columns; ++k) {
    float peak = 0;
    for (int i = 0; i < rows; ++i) peak = std::max(peak, std::abs(factor[i * columns + k]));
    if (!(peak > 0)) continue;
    const float scale = peak / kBasisPeak;
    result.scales[k] = scale;
    for (int i = 0; i < rows; ++i) {
      result.values[i * columns + k] = std::round(factor[i * columns + k] / scale);
    }
  }
  return result;
}

/// Writes the prefix sums of [16][columns] along the first axis and replaces the values by the
/// differences of these sums, as a reader decodes them.
void writePrefixSums(std::vector<float>& values, int columns, std::vector<std::int32_t>& out) {
  std::vector<double> sums(columns, 0.0);
  std::vector<std::int32_t> before(columns, 0);
  for (int i = 0; i < kBlockSize; ++i) {
    for (int k = 0; k < columns; ++k) {
      sums[k] += values[i * columns + k];
      const auto stored = static_cast<std::int32_t>(sums[k]);
      out.push_back(stored);
      values[i * columns + k] = differenceOf(stored, before[k]);
      before[k] = stored;
    }
  }
}

/// Writes the sums of images [16][16][columns] over the pixels below and left of each pixel, and replaces the values by the
/// differences of these sums, as a reader decodes them.
void writeAreaSums(std::vector<float>& values, int columns, std::vector<std::int32_t>& out) {
  std::vector<double> above(static_cast<std::size_t>(kBlockSize) * columns, 0.0);
  std::vector<std::int32_t> stored_above(static_cast<std::size_t>(kBlockSize) * columns, 0);
  for (int y = 0; y < kBlockSize; ++y) {
    std::vector<double> row(columns, 0.0);
    std::vector<std::int32_t> left(columns, 0);
    std::vector<std::int32_t> diagonal(columns, 0);
    for (int x = 0; x < kBlockSize; ++x) {
      for (int k = 0; k < columns; ++k) {
        float& value = values[(y * kBlockSize + x) * columns + k];
        const int i = x * columns + k;
        row[k] += value;
        above[i] += row[k];
        const auto stored = static_cast<std::int32_t>(above[i]);
        out.push_back(stored);
        value = differenceOf(stored, left[k]) - differenceOf(stored_above[i], diagonal[k]);
        diagonal[k] = stored_above[i];
        left[k] = stored_above[i] = stored;
      }
    }
  }
}

/// Quantised basis images, as a reader decodes them, and the matrix that gives their coefficients for a slice.
struct DecodedBasis {
  int columns = 0;
  int stride = 0;             // columns with padding
  std::vector<float> images;  // [columns][256], in the scaled domain
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
void solveDual(DecodedBasis& basis) {
  using Matrix = Eigen::Matrix<double, Eigen::Dynamic, Eigen::Dynamic, Eigen::RowMajor>;
  const Eigen::Map<const Eigen::Matrix<float, Eigen::Dynamic, Eigen::Dynamic, Eigen::RowMajor>> images(
      basis.images.data(), basis.columns, kBlockPixels);
  const Matrix rows = images.cast<double>();
  Matrix gram = rows * rows.transpose();
  // The second term keeps a basis of zeros solvable.
  gram.diagonal().array() += kCpRidge * gram.trace() / basis.columns + 1e-30;
  const Matrix solved = gram.llt().solve(rows);
  for (int k = 0; k < basis.columns; ++k)
    for (int p = 0; p < kBlockPixels; ++p) basis.dual[p * basis.stride + k] = static_cast<float>(solved(k, p));
}

/// The same for orthogonal images: each divided by its power.
void transposeOrthogonal(DecodedBasis& basis) {
  for (int k = 0; k < basis.columns; ++k) {
    const float* image = basis.images.data() + static_cast<std::size_t>(k) * kBlockPixels;
    double power = 1e-30;
    for (int p = 0; p < kBlockPixels; ++p) power += static_cast<double>(image[p]) * image[p];
    for (int p = 0; p < kBlockPixels; ++p) basis.dual[p * basis.stride + k] = static_cast<float>(image[p] / power);
  }
}

/// Quantises the basis, appends its prefix sums to `sums`, and decodes it again.
DecodedBasis encodeBasis(const ClusterBasis& basis, const BlockScale& scale, CompressionMethod method,
                         std::vector<std::int32_t>& sums) {
  DecodedBasis out;
  if (method == CompressionMethod::pca) {
    QuantizedFactor images = quantizeFactor(basis.x, kBlockPixels, basis.rank_x);
    writeAreaSums(images.values, basis.rank_x, sums);
    out.scales = images.scales;
    for (int k = 0; k < basis.rank_x; ++k)
      for (int p = 0; p < kBlockPixels; ++p) out.images.push_back(images.scales[k] * images.values[p * basis.rank_x + k]);
  } else {
    const int rank_y = basis.rank_y;
    QuantizedFactor x = quantizeFactor(basis.x, kBlockSize, basis.rank_x);
    QuantizedFactor y = quantizeFactor(basis.y, kBlockSize, rank_y);
    writePrefixSums(x.values, basis.rank_x, sums);
    writePrefixSums(y.values, rank_y, sums);
    for (const ClusterColumn& column : basis.columns) {
      const bool tucker = method == CompressionMethod::tucker;
      appendProduct(x, basis.rank_x, tucker ? column.index % kBlockSize : column.index, y, rank_y,
                    tucker ? column.index / kBlockSize : column.index, out);
    }
  }
  out.columns = static_cast<int>(out.scales.size());
  std::vector<float> factors(kBlockPixels);
  scale.factors(1, factors.data());
  for (std::size_t k = 0; k < out.images.size(); ++k) out.images[k] *= factors[k % kBlockPixels];
  out.stride = paddedColumns(out.columns);
  out.dual.assign(static_cast<std::size_t>(kBlockPixels) * out.stride, 0.0f);
  method == CompressionMethod::cp ? solveDual(out) : transposeOrthogonal(out);
  return out;
}

/// Solves the coefficients of all slices, [slices][stride].
std::vector<float> solveCoefficients(const SliceIndex& index, std::size_t cluster, const float* factors,
                                     const DecodedBasis& basis) {
  const int count = index.sliceCount(cluster);
  std::vector<float> coefficients(static_cast<std::size_t>(count) * basis.stride);
  std::vector<float> panel(static_cast<std::size_t>(std::min(count, kPanelSlices)) * kSliceStride, 0.0f);
  for (int first = 0; first < count; first += kPanelSlices) {
    const int slices = std::min(kPanelSlices, count - first);
    index.load(cluster, first, slices, factors, panel.data());
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

/// Decodes all slices panel by panel. A basis without columns decodes to zeros.
/// @param visit  called with each slice and its decoded form, [256] scaled pixels, in the order of slices
template <class Visit>
void forEachDecoded(const SliceIndex& index, std::size_t cluster, const float* factors, const DecodedBasis& basis,
                    const std::vector<float>& coefficients, Visit visit) {
  const int count = index.sliceCount(cluster);
  const std::size_t panel_size = static_cast<std::size_t>(std::min(count, kPanelSlices)) * kSliceStride;
  std::vector<float> panel(panel_size, 0.0f);
  std::vector<float> decoded(panel_size, 0.0f);
  for (int first = 0; first < count; first += kPanelSlices) {
    const int slices = std::min(kPanelSlices, count - first);
    index.load(cluster, first, slices, factors, panel.data());
    multiply({coefficients.data() + static_cast<std::size_t>(first) * basis.stride, basis.stride, 1}, basis.images.data(),
             kBlockPixels, decoded.data(), kSliceStride, slices, kBlockPixels, basis.columns);
    for (int s = 0; s < slices; ++s) visit(panel.data() + s * kSliceStride, decoded.data() + s * kSliceStride);
  }
}

/// Density of the rest of a slice.
float restOf(const float* slice, const SliceSpots& spots, const SpotFinder& finder) {
  float match = finder.evenMatch(slice), left = 0;
  for (int p = 0; p < kBlockPixels; ++p) left += slice[p] * slice[p];
  for (const Spot& spot : spots) match -= spot.weight * finder.evenShare(spot), left -= spot.gain;
  return finder.restDensity(match, left);
}

/// Light of a slice: the sum of its pixels, which are not scaled.
double lightOf(const float* slice, const float* factors) {
  double light = 0;
  for (int p = 0; p < kBlockPixels; ++p) light += slice[p] / factors[p];
  return light;
}

/// Factor of the spots and rests of a cluster that gives them its light. Spots that are left out take light away, most where facets
/// are many and small: a direction would be too dark in all places, which is seen sooner than single spots that are too bright.
double lightFactor(double truth, double decoded) {
  constexpr double kMost = 1.25;
  return decoded > 0 ? std::clamp(truth / decoded, 1 / kMost, kMost) : 1.0;
}

/// Quantises a cluster of spots, writes it as ndf_cp.h says, and compares its decoded slices with the originals.
void encodeSpots(const SliceIndex& index, std::size_t cluster, const float* factors, const SpotFinder& finder,
                 const std::vector<SliceSpots>& spots, EncodedCluster& out, SliceComparer& comparer) {
  // Find the largest weight and rest of all slices, which give the scales.
  const auto all = static_cast<std::uint32_t>(spots.size());
  std::vector<float> slice(kSliceStride), decoded(kBlockPixels), rests;
  float most_weight = 0, most_rest = 0;
  for (std::uint32_t s = 0; s < all; ++s) {
    index.load(cluster, static_cast<int>(s), 1, factors, slice.data());
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
  // Write the spots.
  std::vector<std::uint16_t> weights;
  for (const SliceSpots& slice_spots : spots) {
    for (const Spot& spot : slice_spots) {
      const float weight = std::clamp(std::round(spot.weight / out.scales[0]), 0.0f, 65535.0f);
      weights.push_back(static_cast<std::uint16_t>(weight));
      append(out.coefficients, NdfSpot{spot.x, spot.y, weights.back()});
    }
  }
  // Decodes every slice as a reader does.
  const auto forEachSlice = [&](auto visit) {
    auto weight = weights.begin();
    for (std::uint32_t s = 0; s < all; ++s) {
      index.load(cluster, static_cast<int>(s), 1, factors, slice.data());
      finder.setEven(out.scales[1] * blockMass(codes[s]), decoded.data());
      for (const Spot& spot : spots[s]) finder.add(spot.x, spot.y, out.scales[0] * *weight++, decoded.data());
      visit(slice.data(), decoded.data());
    }
  };
  double truth_light = 0, decoded_light = 0;
  forEachSlice([&](const float* truth, const float* image) {
    truth_light += lightOf(truth, factors), decoded_light += lightOf(image, factors);
  });
  for (float& scale : out.scales) scale *= static_cast<float>(lightFactor(truth_light, decoded_light));
  forEachSlice([&](const float* truth, const float* image) { comparer.add(truth, image); });
}

/// Slices that are worth storing: they hold at least the weighted energy `least`, or more than a 256th of the mass of their
/// image.
std::vector<std::uint32_t> worthyRows(const SliceIndex& index, const ErrorWeights& weights, std::size_t cluster,
                                      const ClusterStatistics& statistics, double least) {
  constexpr double kMostOfImage = 1.0 / 256;
  const double pixel_area = 1.0 / index.pixelsPerArea(), peak = statistics.peak;
  std::vector<std::uint32_t> kept;
  std::vector<float> slice(kSliceStride);
  for (int s = 0; s < index.sliceCount(cluster); ++s) {
    double energy = 0, sum = 0, weight = 1;
    if (least > 0) {
      weight = weights.slice(cluster, index.sliceLevel(cluster, s));
      index.load(cluster, s, 1, statistics.factors.data(), slice.data());
      for (int p = 0; p < kBlockPixels; ++p) {
        energy += static_cast<double>(slice[p]) * slice[p];
        sum += slice[p] / statistics.factors[p];
      }
    }
    if (weight * energy * peak * peak >= least || sum * index.unit() * pixel_area > kMostOfImage)
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

EncodedCluster encodeCluster(const SliceIndex& index, const ErrorWeights& weights, std::size_t cluster,
                             const ClusterStatistics& statistics, const ClusterBasis& basis, CompressionMethod method,
                             CoefficientType type, double per_byte, std::span<const float> density_scales) {
  // Spots, and clusters of nothing, have no columns.
  EncodedCluster out;
  const int count = index.sliceCount(cluster);
  const float* factors = statistics.factors.data();
  SliceComparer comparer(index, weights, cluster, statistics, density_scales);
  if (!basis.spots.empty()) {
    const SpotFinder finder(index.sigmaPixels(), weights.scale(cluster));
    encodeSpots(index, cluster, factors, finder, basis.spots, out, comparer);
    out.errors = comparer.take();
    if (method == CompressionMethod::tucker) out.core.resize(out.scales.size());
    for (float& scale : out.scales) scale *= statistics.peak * index.unit();
    return out;
  }
  if (basis.columns.empty()) {
    forEachDecoded(index, cluster, factors, {}, {},
                   [&](const float* slice, const float* decoded) { comparer.add(slice, decoded); });
    out.errors = comparer.take();
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
  const DecodedBasis decoded = encodeBasis(basis, weights.scale(cluster), method, out.basis);
  std::vector<float> coefficients = solveCoefficients(index, cluster, factors, decoded);
  // Leave out slices that are not worth their bytes, and quantise the coefficients of all others.
  const double row_bytes =
      type == CoefficientType::i8 ? out.columns - 0.5 * out.narrow_columns : 1.0 * out.columns * coefficientElementBytes(type);
  out.kept = worthyRows(index, weights, cluster, statistics, (row_bytes + 1) * per_byte);
  keepRows(out.kept, decoded.stride, coefficients);
  out.scales = quantizeCoefficients(coefficients, static_cast<int>(out.kept.size()), decoded.stride, basis.columns, type,
                                    out.coefficients);
  for (int k = 0; k < decoded.columns; ++k) out.scales[k] *= decoded.scales[k] * statistics.peak * index.unit();
  // Find the floors, and measure the error as a reader sees it.
  spreadRows(out.kept, count, decoded.stride, coefficients);
  const float density = statistics.peak * index.unit();
  FloorFinder finder(weights.scale(cluster), density);
  forEachDecoded(index, cluster, factors, decoded, coefficients,
                 [&](const float* slice, const float* image) { finder.add(slice, image); });
  out.floors = finder.find();
  comparer.setFloors(out.floors, density);
  forEachDecoded(index, cluster, factors, decoded, coefficients,
                 [&](const float* slice, const float* image) { comparer.add(slice, image); });
  out.errors = comparer.take();
  return out;
}

}  // namespace glint::bake
