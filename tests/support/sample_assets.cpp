#include "support/sample_assets.h"

#include <algorithm>
#include <bit>
#include <cmath>

#include "glint/model/slope_sums.h"

namespace glint::test {
namespace {

constexpr int kResolution = 64;
constexpr float kSigmaR = 0.05f;
constexpr double kBasisUnit = 1000;  // integer bases store basis * kBasisUnit

double noise(int i, int j) {
  auto h = static_cast<std::uint32_t>(i) * 0x9e3779b1u ^ static_cast<std::uint32_t>(j) * 0x85ebca77u;
  h ^= h >> 15;
  h *= 0x2c1b3c6du;
  h ^= h >> 12;
  return h * 0x1p-32;
}

using Image = std::vector<double>;  // [kResolution][kResolution] densities

Image blurred(const Image& image) {
  const double sigma_pixels = kSigmaR * kResolution / 2;
  const int radius = static_cast<int>(std::ceil(3 * sigma_pixels));
  Image rows(image.size());
  Image both(image.size());
  for (int pass = 0; pass < 2; ++pass) {
    const Image& from = pass == 0 ? image : rows;
    Image& to = pass == 0 ? rows : both;
    for (int y = 0; y < kResolution; ++y) {
      for (int x = 0; x < kResolution; ++x) {
        for (int d = -radius; d <= radius; ++d) {
          const int sx = pass == 0 ? x + d : x;
          const int sy = pass == 0 ? y : y + d;
          if (sx < 0 || sy < 0 || sx >= kResolution || sy >= kResolution) continue;
          to[static_cast<std::size_t>(y * kResolution + x)] +=
              std::exp(-0.5 * d * d / (sigma_pixels * sigma_pixels)) * from[static_cast<std::size_t>(sy * kResolution + sx)];
        }
      }
    }
  }
  return both;
}

/// The NDF image of the Gaussian footprint around (u, v) in texels, normalised.
Image footprintImage(const NormalMap& map, double u, double v, double sigma) {
  Image image(kResolution * kResolution);
  for (int j = 0; j < map.height; ++j) {
    for (int i = 0; i < map.width; ++i) {
      const double du = std::remainder(i + 0.5 - u, map.width);
      const double dv = std::remainder(j + 0.5 - v, map.height);
      const Vec2 n = map.at(i, j);
      const int x = static_cast<int>((n.x + 1) * kResolution / 2);
      const int y = static_cast<int>((n.y + 1) * kResolution / 2);
      image[static_cast<std::size_t>(y * kResolution + x)] += std::exp(-0.5 * (du * du + dv * dv) / (sigma * sigma));
    }
  }
  image = blurred(image);
  // Drop the tail so that some blocks are empty.
  const double peak = *std::max_element(image.begin(), image.end());
  double sum = 0;
  for (double& d : image) sum += d = d < 1e-3 * peak ? 0 : d;
  for (double& d : image) d /= sum * 4 / (kResolution * kResolution);
  return image;
}

PyramidShape sampleShape(int size) {
  PyramidShape shape;
  shape.width = shape.height = size;
  shape.resolution = kResolution;
  shape.sigma_r = kSigmaR;
  shape.level_count = 3;
  shape.slopes = {{0.01f, -0.02f}, {0.03f, -0.004f, 0.01f}};
  for (int l = 0; l < 3; ++l) {
    const int side = 4 >> l;
    shape.levels[l] = {static_cast<float>(size) / static_cast<float>(side), side, side};
  }
  return shape;
}

std::vector<Image> levelImages(const NormalMap& map, const PyramidGrid& grid) {
  std::vector<Image> images;
  for (int j = 0; j < grid.rows; ++j) {
    for (int i = 0; i < grid.columns; ++i) {
      images.push_back(
          footprintImage(map, (i + 0.5) * grid.stride, (j + 0.5) * grid.stride, kFootprintPerStride * grid.stride));
    }
  }
  return images;
}

double blockPixel(const Image& image, int block, int x, int y) {
  const int bx = block % (kResolution / kBlockSize);
  const int by = block / (kResolution / kBlockSize);
  return image[static_cast<std::size_t>((by * kBlockSize + y) * kResolution + bx * kBlockSize + x)];
}

double blockMean(const Image& image, int block) {
  double sum = 0;
  for (int y = 0; y < kBlockSize; ++y) {
    for (int x = 0; x < kBlockSize; ++x) sum += blockPixel(image, block, x, y);
  }
  return sum / kBlockPixels;
}

constexpr double kSampleSpot = 0.64;  // pixels

/// Two functions along an axis of a block, orthogonal: a constant and a slope.
double axisFunction(int k, int x) { return k == 0 ? 1 : (x - 7.5) / 7.5; }

/// The functions along x and y of a column of the basis: cp and pca know (k, l) = 00, 10, 01; tucker all four.
void columnFunctions(CompressionMethod method, int column, int& k, int& l) {
  k = method == CompressionMethod::tucker ? column / 2 : column == 1;
  l = method == CompressionMethod::tucker ? column % 2 : column == 2;
}

/// Coefficient of a block for a column: projection on the product of its functions.
double projection(const Image& image, int block, int k, int l) {
  double dot = 0;
  double norm = 0;
  for (int y = 0; y < kBlockSize; ++y) {
    for (int x = 0; x < kBlockSize; ++x) {
      const double f = axisFunction(k, x) * axisFunction(l, y);
      dot += f * blockPixel(image, block, x, y);
      norm += f * f;
    }
  }
  return dot / norm;
}

/// Prefix sums of the basis of one cluster, in units of kBasisUnit per axis (pca: per image).
std::vector<double> basisSums(CompressionMethod method) {
  std::vector<double> sums;
  const auto axis = [&](bool along_y, int columns) {
    for (int x = 0; x < kBlockSize; ++x) {
      for (int c = 0; c < columns; ++c) {
        int k = c;
        int l = c;
        if (method == CompressionMethod::cp) columnFunctions(method, c, k, l);
        double sum = 0;
        for (int t = 0; t <= x; ++t) sum += std::round(kBasisUnit * axisFunction(along_y ? l : k, t));
        sums.push_back(sum);
      }
    }
  };
  if (method != CompressionMethod::pca) {
    const int columns = method == CompressionMethod::cp ? 3 : 2;
    axis(false, columns);
    axis(true, columns);
    return sums;
  }
  for (int y = 0; y < kBlockSize; ++y) {
    for (int x = 0; x < kBlockSize; ++x) {
      for (int c = 0; c < 3; ++c) {
        int k = 0;
        int l = 0;
        columnFunctions(method, c, k, l);
        double sum = 0;
        for (int t = 0; t <= y; ++t) {
          for (int s = 0; s <= x; ++s) sum += std::round(kBasisUnit * axisFunction(k, s) * axisFunction(l, t));
        }
        sums.push_back(sum);
      }
    }
  }
  return sums;
}

int columnsOf(CompressionMethod method) { return method == CompressionMethod::tucker ? 4 : 3; }

/// Adds the coefficients of one cluster, [slices][columns], and its scales.
void addCoefficients(SampleNdfCp& sample, const std::vector<std::vector<double>>& slices, std::size_t narrow) {
  const CompressionMethod method = sample.ndf.method;
  const double unit = method == CompressionMethod::pca ? kBasisUnit : kBasisUnit * kBasisUnit;
  const auto columns = static_cast<std::size_t>(columnsOf(method));
  std::vector<double> steps(columns, 1);
  for (std::size_t c = 0; c < columns; ++c) {
    double most = 0;
    for (const auto& slice : slices) most = std::max(most, std::abs(slice[c]));
    const double peak = c < columns - narrow ? 127 : 7;
    if (sample.ndf.coefficient_type == CoefficientType::i8) steps[c] = most > 0 ? most / peak : 1;
    sample.scales.push_back(static_cast<float>(steps[c] / unit));
    if (method == CompressionMethod::tucker) sample.core.push_back(static_cast<std::uint8_t>(c / 2 + 16 * (c % 2)));
  }
  for (const auto& slice : slices) {
    for (std::size_t c = 0; c < columns; ++c) {
      const double value = slice[c] / steps[c];
      if (c >= columns - narrow) continue;
      switch (sample.ndf.coefficient_type) {
        case CoefficientType::i8:
          sample.coefficients_i8.push_back(static_cast<std::int8_t>(std::lround(value)));
          break;
        case CoefficientType::f16:
          sample.coefficients_f16.push_back(floatToHalf(static_cast<float>(value)));
          break;
        case CoefficientType::f32:
          sample.coefficients_f32.push_back(static_cast<float>(value));
          break;
      }
    }
    if (narrow == 0) continue;
    const auto bits = [&](std::size_t c) { return static_cast<unsigned>(std::lround(slice[c] / steps[c])) & 15u; };
    sample.coefficients_i8.push_back(static_cast<std::int8_t>(bits(columns - 2) | bits(columns - 1) << 4));
  }
}

/// Every slice as a spot that holds half of it, at a place of its own, and an even rest.
void addSpotSlices(SampleNdfCp& sample, const std::vector<double>& means) {
  auto& bytes = sample.coefficients_i8;
  const auto append = [&](const auto& value) {
    const auto* first = reinterpret_cast<const std::int8_t*>(&value);
    bytes.insert(bytes.end(), first, first + sizeof value);
  };
  const double most = *std::max_element(means.begin(), means.end());
  sample.scales.push_back(static_cast<float>(most * kBlockPixels / 2 / 65535));
  sample.scales.push_back(static_cast<float>(most / 2));
  sample.core.insert(sample.core.end(), 2, 0);
  for (std::size_t first = 0; first < means.size(); first += kSpotGroup) append(static_cast<std::uint32_t>(first));
  for (std::size_t s = 0; s < means.size(); ++s) append(std::uint8_t{1});
  for (const double mean : means) {
    int code = 0;
    while (halfToFloat(static_cast<std::uint16_t>(code << 6)) < mean / most) ++code;
    append(static_cast<std::uint8_t>(code));
  }
  while (bytes.size() % sizeof(NdfSpot) != 0) append(std::uint8_t{0});
  for (std::size_t s = 0; s < means.size(); ++s)
    append(NdfSpot{static_cast<std::uint8_t>(20 + 7 * (s % 20)), static_cast<std::uint8_t>(60 + 5 * (s % 20)),
                   static_cast<std::uint16_t>(std::lround(65535 * means[s] / most))});
}

std::uint64_t coefficientCount(const SampleNdfCp& sample) {
  return sample.coefficients_i8.size() + sample.coefficients_f16.size() + sample.coefficients_f32.size();
}

void addBasis(SampleNdfCp& sample) {
  for (const double sum : basisSums(sample.ndf.method)) {
    sample.basis.push_back(static_cast<std::int32_t>(sum));
  }
}

void addCluster(SampleNdfCp& sample, const std::vector<const Image*>& slots, int block, SampleForm form) {
  NdfCluster cluster;
  if (form == SampleForm::spots) sample.coefficients_i8.resize((sample.coefficients_i8.size() + 3) / 4 * 4);
  cluster.first_basis = static_cast<std::uint32_t>(sample.basis.size());
  cluster.first_coefficient = coefficientCount(sample);
  cluster.first_scale = static_cast<std::uint32_t>(sample.scales.size());
  cluster.first_word = static_cast<std::uint32_t>(sample.masks.size());
  std::vector<double> means;
  std::vector<std::vector<double>> slices;
  std::uint64_t mask = 0;
  for (std::size_t slot = 0; slot < slots.size(); ++slot) {
    if (blockMean(*slots[slot], block) == 0) continue;
    mask |= std::uint64_t{1} << slot;
    std::vector<double> slice;
    for (int c = 0; c < columnsOf(sample.ndf.method); ++c) {
      int k = 0;
      int l = 0;
      columnFunctions(sample.ndf.method, c, k, l);
      slice.push_back(projection(*slots[slot], block, k, l));
    }
    slices.push_back(slice);
    means.push_back(blockMean(*slots[slot], block));
  }
  cluster.slice_count = static_cast<std::uint32_t>(slices.size());
  if (!slices.empty() && form == SampleForm::spots) {
    addSpotSlices(sample, means);
  } else if (!slices.empty()) {
    cluster.columns = static_cast<std::uint16_t>(columnsOf(sample.ndf.method));
    cluster.narrow_columns = form == SampleForm::narrow ? 2 : 0;
    cluster.rank_x = cluster.rank_y = sample.ndf.method == CompressionMethod::tucker ? 2 : 0;
    cluster.floor_unit = floatToHalf(0.25f);
    addBasis(sample);
    addCoefficients(sample, slices, cluster.narrow_columns);
  }
  // Floors of 0.02 to 0.13 in clusters of columns.
  for (int cell = 0; cell < kFloorCells; ++cell)
    sample.floors.push_back(cluster.columns > 0 ? static_cast<std::uint8_t>(180 + 3 * cell) : 0);
  sample.clusters.push_back(cluster);
  sample.masks.push_back(mask);
  sample.mask_ranks.push_back(0);
}

void linkSpans(SampleNdfCp& sample) {
  NdfCp& ndf = sample.ndf;
  ndf.image_regions = sample.image_regions;
  ndf.image_slots = sample.image_slots;
  ndf.image_scales = sample.image_scales;
  ndf.density_scales = sample.density_scales;
  ndf.block_masks = sample.block_masks;
  ndf.first_block = sample.first_block;
  ndf.block_masses = sample.block_masses;
  ndf.clusters = sample.clusters;
  ndf.masks = sample.masks;
  ndf.mask_ranks = sample.mask_ranks;
  ndf.scales = sample.scales;
  ndf.core = sample.core;
  ndf.block_places = sample.block_places;
  ndf.place_blocks = sample.place_blocks;
  ndf.spot_sums = sample.spot_sums;
  ndf.floors = sample.floors;
  ndf.basis = sample.basis;
  ndf.coefficients = !sample.coefficients_i8.empty()    ? static_cast<const void*>(sample.coefficients_i8.data())
                     : !sample.coefficients_f16.empty() ? static_cast<const void*>(sample.coefficients_f16.data())
                                                        : sample.coefficients_f32.data();
  ndf.coefficient_count = coefficientCount(sample);
}

double basisElement(const NdfCp& ndf, std::uint64_t index) { return ndf.basis[index]; }

double coefficientElement(const NdfCp& ndf, std::uint64_t index) {
  switch (ndf.coefficient_type) {
    case CoefficientType::i8:
      return static_cast<const std::int8_t*>(ndf.coefficients)[index];
    case CoefficientType::f16:
      return halfToFloat(static_cast<const std::uint16_t*>(ndf.coefficients)[index]);
    default:
      return static_cast<const float*>(ndf.coefficients)[index];
  }
}

/// Cluster that has the pixel of an image.
std::size_t clusterOf(const NdfCp& ndf, int image, int x, int y) {
  const int block = y / kBlockSize * ndf.shape.blocksPerAxis() + x / kBlockSize;
  return static_cast<std::size_t>(ndf.image_regions[static_cast<std::size_t>(image)] * ndf.places +
                                  ndf.block_places[static_cast<std::size_t>(block)]);
}

/// Value of a column's basis image at a pixel of its block: differences of the prefix sums.
double basisValue(const NdfCp& ndf, const NdfCluster& cluster, int column, int x, int y) {
  const auto sum = [&](std::uint64_t index) { return basisElement(ndf, cluster.first_basis + index); };
  const auto at = [&](std::uint64_t first, int rank, int t, int c) {
    const auto here = sum(first + static_cast<std::uint64_t>(t * rank + c));
    return t == 0 ? here : here - sum(first + static_cast<std::uint64_t>((t - 1) * rank + c));
  };
  const bool tucker = ndf.method == CompressionMethod::tucker;
  const int rx = tucker ? cluster.rank_x : cluster.columns, ry = tucker ? cluster.rank_y : cluster.columns;
  switch (ndf.method) {
    case CompressionMethod::cp:
      return at(0, rx, x, column) * at(static_cast<std::uint64_t>(kBlockSize * rx), rx, y, column);
    case CompressionMethod::tucker: {
      const int pair = ndf.core[cluster.first_scale + static_cast<std::uint64_t>(column)];
      return at(0, rx, x, pair % kBlockSize) * at(static_cast<std::uint64_t>(kBlockSize * rx), ry, y, pair / kBlockSize);
    }
    default: {
      const auto table = [&](int tx, int ty) {
        return tx < 0 || ty < 0 ? 0.0 : sum(static_cast<std::uint64_t>((ty * kBlockSize + tx) * rx + column));
      };
      return table(x, y) - table(x - 1, y) - table(x, y - 1) + table(x - 1, y - 1);
    }
  }
}

double coefficientValue(const NdfCp& ndf, const NdfCluster& cluster, std::uint64_t slice, int column) {
  const std::uint64_t row = cluster.first_coefficient + slice * static_cast<std::uint64_t>(rowElements(cluster));
  const int narrow = column - (cluster.columns - cluster.narrow_columns);
  if (narrow < 0) return coefficientElement(ndf, row + static_cast<std::uint64_t>(column));
  // The samples have two narrow columns, in one byte.
  const auto byte = static_cast<std::uint8_t>(
      coefficientElement(ndf, row + static_cast<std::uint64_t>(cluster.columns - cluster.narrow_columns)) + 256);
  const int bits = narrow == 0 ? byte & 15 : byte >> 4;
  return bits < 8 ? bits : bits - 16;
}

/// Density of a slice of spots at a pixel of its block. The samples have one spot in each.
double spotValue(const NdfCp& ndf, const NdfCluster& cluster, std::uint64_t slice, int x, int y) {
  const auto* bytes = static_cast<const std::uint8_t*>(ndf.coefficients) + cluster.first_coefficient;
  const NdfSpot spot = reinterpret_cast<const NdfSpot*>(bytes + firstSpotOffset(cluster.slice_count))[slice];
  const auto share = [&](int pixel, int place) {
    const float* edge = &ndf.spot_sums[static_cast<std::size_t>(kSpotSteps * pixel + kLastSpotPlace - place)];
    return static_cast<double>(edge[kSpotSteps] - edge[0]);
  };
  const std::uint8_t code = bytes[spotCountsOffset(cluster.slice_count) + cluster.slice_count + slice];
  return ndf.scales[cluster.first_scale] * spot.weight * share(x, spot.x) * share(y, spot.y) +
         ndf.scales[cluster.first_scale + 1] * static_cast<double>(halfToFloat(static_cast<std::uint16_t>(code << 6)));
}

/// The share of each block in the part of its image above the floors, rounded up to a code: the first that is not below.
void addBlockMasses(SampleNdfCp& sample) {
  const NdfCp& ndf = sample.ndf;
  const int blocks = ndf.shape.blocksPerImage();
  sample.first_block.push_back(0);
  for (std::size_t image = 0; image < sample.image_scales.size(); ++image) {
    std::vector<double> sums(static_cast<std::size_t>(blocks));
    double total = 0;
    for (int p = 0; p < kResolution * kResolution; ++p) {
      const int x = p % kResolution, y = p / kResolution;
      const float pixel = ndfCpPixel(ndf, static_cast<int>(image), x, y) / sample.image_scales[image];
      const double value = std::max(0.0f, pixel - ndfCpFloor(ndf, static_cast<int>(image), x, y));
      sums[static_cast<std::size_t>(y / kBlockSize * ndf.shape.blocksPerAxis() + x / kBlockSize)] += value;
      total += value;
    }
    sample.density_scales.push_back(static_cast<float>(kResolution * kResolution / 4 / total));
    sample.block_masks.push_back(0);
    for (int block = 0; block < blocks; ++block) {
      const auto cluster = static_cast<std::size_t>(sample.image_regions[image] * blocks + block);
      if ((sample.masks[cluster] >> sample.image_slots[image] & 1u) == 0) continue;
      sample.block_masks.back() |= std::uint64_t{1} << block;
      const double share = sums[static_cast<std::size_t>(block)] / total * (1 + 1e-5);
      int code = 0;
      while (code < 255 && halfToFloat(static_cast<std::uint16_t>(code << 6)) < share) ++code;
      sample.block_masses.push_back(static_cast<std::uint8_t>(code));
    }
    sample.first_block.push_back(static_cast<std::uint32_t>(sample.block_masses.size()));
  }
}

/// Nodes of all levels of the bounds of a map, in the shortest way that is right.
std::vector<std::vector<NormalBounds>> boundsOf(const NormalMap& map) {
  std::vector<std::vector<NormalBounds>> levels;
  for (int k = 1;; ++k) {
    const int block = 1 << k;
    const int columns = (map.width + block - 1) / block;
    const int rows = (map.height + block - 1) / block;
    std::vector<NormalBounds> nodes;
    for (int j = 0; j < rows; ++j) {
      for (int i = 0; i < columns; ++i) {
        NormalBounds node{2, 2, -2, -2};
        for (int y = j * block; y <= std::min((j + 1) * block, map.height); ++y) {
          for (int x = i * block; x <= std::min((i + 1) * block, map.width); ++x) {
            const Vec2 n = map.at(x % map.width, y % map.height);
            node = {std::min(node.low_x, n.x), std::min(node.low_y, n.y), std::max(node.high_x, n.x),
                    std::max(node.high_y, n.y)};
          }
        }
        nodes.push_back(node);
      }
    }
    levels.push_back(std::move(nodes));
    if (columns == 1 && rows == 1) return levels;
  }
}

}  // namespace

SampleNormals sampleNormals(int width, int height, bool with_bounds) {
  SampleNormals sample;
  for (int j = 0; j < height; ++j) {
    for (int i = 0; i < width; ++i) {
      const double wave = 0.25 * std::sin(6.283185307 * (3.0 * i / width + 2.0 * j / height));
      sample.normals.push_back(
          {static_cast<float>(wave + 0.1 * (noise(i, j) - 0.5)), static_cast<float>(0.3 * (noise(j, i + 7) - 0.5))});
    }
  }
  sample.map.width = width;
  sample.map.height = height;
  sample.map.texel_size_um = 2.5f;
  sample.map.normals = sample.normals;
  if (!with_bounds) return sample;
  sample.bounds = boundsOf(sample.map);
  for (const std::vector<NormalBounds>& nodes : sample.bounds) {
    const int block = 2 << sample.map.bounds_level_count;
    sample.map.bounds[sample.map.bounds_level_count++] = {(width + block - 1) / block, (height + block - 1) / block, nodes};
  }
  return sample;
}

SampleNearNormals sampleNearNormals(int size, NearType type) {
  constexpr float kStep = 0x1p-15f;
  SampleNearNormals sample;
  sample.normals = sampleNormals(size, size, false).normals;
  const auto codeOf = [](float x) { return static_cast<std::int16_t>(std::lrint(x / kStep)); };
  if (type == NearType::i16) {
    for (Vec2& n : sample.normals) {
      const NormalCode code = {codeOf(n.x), codeOf(n.y)};
      sample.codes.push_back(code);
      n = {kStep * static_cast<float>(code.x), kStep * static_cast<float>(code.y)};
    }
  }
  NormalMap map;
  map.width = map.height = size;
  map.normals = sample.normals;
  sample.bounds = boundsOf(map);
  NearNormals& near = sample.near;
  near.width = near.height = size;
  near.type = type;
  near.step = type == NearType::i16 ? kStep : 1;
  near.texels = type == NearType::i16 ? static_cast<const void*>(sample.codes.data()) : sample.normals.data();
  for (const std::vector<NormalBounds>& nodes : sample.bounds) {
    std::vector<CodeBounds>& codes = sample.code_bounds.emplace_back();
    for (const NormalBounds& b : nodes) codes.push_back({codeOf(b.low_x), codeOf(b.low_y), codeOf(b.high_x), codeOf(b.high_y)});
    const int block = 2 << near.bounds_level_count, along = (size + block - 1) / block;
    near.bounds[near.bounds_level_count++] = {along, along,
                                              type == NearType::i16 ? static_cast<const void*>(codes.data()) : nodes.data()};
  }
  return sample;
}

SamplePyramid samplePyramidWithNormals(int size, NearType type) {
  SamplePyramid sample = samplePyramid(size, BlockPrecision::f16);
  sample.kept = sampleNearNormals(size, type);
  sample.pyramid.near_normals = sample.kept.near;
  return sample;
}

SampleNdfCp sampleNdfCpWithNormals(int size, NearType type) {
  SampleNdfCp sample = sampleNdfCp(size, CompressionMethod::tucker, CoefficientType::i8);
  sample.kept = sampleNearNormals(size, type);
  sample.ndf.near_normals = sample.kept.near;
  return sample;
}

SampleHeights sampleHeights(int width, int height) {
  SampleHeights sample;
  for (int j = 0; j < height; ++j) {
    for (int i = 0; i < width; ++i) sample.heights.push_back(static_cast<float>(noise(i, j) - 0.5));
  }
  sample.map.width = width;
  sample.map.height = height;
  sample.map.heights = sample.heights;
  return sample;
}

SampleDisplacement sampleDisplacement(int size, bool colored) {
  SampleDisplacement sample;
  Displacement& d = sample.displacement;
  d.width = size, d.height = size / 2, d.texel_size_um = 2.5f;
  d.base = {BaseBrdf::Kind::ggx, 1, 0.25f, 1.5f, 3};
  d.channels = colored ? 3 : 1, d.lobe_count = 2, d.angular = 3, d.level_count = 2, d.more_terms = colored ? 2 : 0;
  sample.levels.resize(2);
  for (int l = 0; l < 2; ++l) {
    SampleDisplacement::Level& from = sample.levels[static_cast<std::size_t>(l)];
    DisplacementLevel& to = d.levels[l];
    to.factor = 4 << l, to.columns = d.width / to.factor, to.rows = d.height / to.factor;
    to.spatial_columns = 2, to.spatial_rows = 1;
    to.rank1_residual = 0.125f, to.scale_residual = colored ? 0.03125f : 0.125f, to.rank1_energy = 0.75f,
    to.interreflected_share = 0.25f, to.distant_share = 0.0625f;
    for (int j = 0; j < to.rows; ++j) {
      for (int i = 0; i < to.columns; ++i) {
        const auto bump = static_cast<float>(noise(i, j + 100 * l) - 0.5);
        from.heights.push_back(4 * bump);
        from.lobes.push_back({{0.5f * bump, 0.25f}, 20 + 10 * bump, 0.75f});
        from.lobes.push_back({{-0.25f, bump}, kMaxKappa, 0.375f});
        for (int k = 0; colored && k < 6; ++k) from.lobe_colors.push_back(0.125f * static_cast<float>(k + 1));
        for (int k = 0; colored && k < 2; ++k) from.lobe_alphas.push_back(0.5f + 0.25f * bump);
        from.slopes.push_back({{bump, -0.125f}, {0.25f, 0.0625f * bump, 0.5f}});
        from.fit_errors.push_back(0.125f + 0.125f * bump);
      }
    }
    for (const float t : {0.75f, 1.25f})
      from.spatial_scale.insert(from.spatial_scale.end(), static_cast<std::size_t>(d.channels), t);
    for (int k = 0; k < 45 * d.channels; ++k)
      from.angular_scale.push_back(floatToHalf(0.5f + 0.03125f * static_cast<float>(k / d.channels)));
    for (int t = 0; t < d.more_terms; ++t) {
      for (const float s : {-0.25f, 0.25f})
        from.spatial_terms.insert(from.spatial_terms.end(), static_cast<std::size_t>(d.channels), s);
      for (int k = 0; k < 45 * d.channels; ++k)
        from.angular_terms.push_back(floatToHalf(0.125f - 0.03125f * static_cast<float>(k % 7)));
    }
    from.singular_shares = {0.75f, 0.125f, 0.0625f, 0, 0, 0, 0, 0};
    to.spatial_terms = from.spatial_terms, to.angular_terms = from.angular_terms, to.singular_shares = from.singular_shares;
    to.heights = from.heights, to.lobes = from.lobes, to.slopes = from.slopes, to.fit_errors = from.fit_errors;
    to.spatial_scale = from.spatial_scale, to.angular_scale = from.angular_scale;
    to.lobe_colors = from.lobe_colors, to.lobe_alphas = from.lobe_alphas;
  }
  return sample;
}

SampleDisplacement sampleDisplacedTable(int size) {
  SampleDisplacement sample = sampleDisplacement(size);
  Displacement& d = sample.displacement;
  d.base = {BaseBrdf::Kind::table, 1, 0.25f, 1, 0};
  for (std::size_t k = 0; k < kBaseTables * kBaseTableNodes; ++k)
    sample.base_table.push_back(0.0625f * static_cast<float>(k % 48 + k / 48 % 48 + k / 2304 % 32 + k / kBaseTableNodes));
  d.table = BaseTable{0.375f, sample.base_table};
  return sample;
}

namespace {

/// Stores the occupied blocks of the images of a level.
void addLevel(SamplePyramid& sample, int l, const std::vector<Image>& images) {
  NdfPyramid& pyramid = sample.pyramid;
  SamplePyramid::Level& level = sample.levels[static_cast<std::size_t>(l)];
  for (const Image& image : images) {
    level.mask_ranks.push_back(static_cast<std::uint32_t>(level.block_means.size()));  // one word: at most 64 blocks
    level.masks.push_back(0);
    for (int block = 0; block < pyramid.shape.blocksPerImage(); ++block) {
      const double mean = blockMean(image, block);
      if (mean == 0) continue;
      level.masks.back() |= std::uint64_t{1} << block;
      level.block_means.push_back(static_cast<float>(mean));
      for (int k = 0; k < kBlockPixels; ++k) {
        const double stored = blockPixel(image, block, k % kBlockSize, k / kBlockSize) / pyramid.value_scale;
        level.halves.push_back(floatToHalf(static_cast<float>(stored)));
        level.floats.push_back(static_cast<float>(stored));
      }
    }
  }
  level.mask_ranks.push_back(static_cast<std::uint32_t>(level.block_means.size()));
  const void* pixels =
      pyramid.precision == BlockPrecision::f16 ? static_cast<const void*>(level.halves.data()) : level.floats.data();
  pyramid.levels[l] = {level.masks, level.mask_ranks, level.block_means, pixels};
}

}  // namespace

SamplePyramid samplePyramid(int size, BlockPrecision precision) {
  SamplePyramid sample;
  const SampleNormals normals = sampleNormals(size, size, false);
  NdfPyramid& pyramid = sample.pyramid;
  pyramid.shape = sampleShape(size);
  pyramid.precision = precision;
  pyramid.value_scale = 4;
  sample.levels.resize(static_cast<std::size_t>(pyramid.shape.level_count));
  for (int l = 0; l < pyramid.shape.level_count; ++l) addLevel(sample, l, levelImages(normals.map, pyramid.shape.levels[l]));
  return sample;
}

SamplePyramidShard samplePyramidShard(int size) {
  SamplePyramidShard sample = {samplePyramid(size, BlockPrecision::f16), {}};
  NdfPyramidShard& shard = sample.shard;
  shard.region = {1, 2};
  shard.level_choice = LevelChoice::agreeing;
  shard.images = sample.whole.pyramid;
  for (int l = 0; l < shard.images.shape.level_count; ++l) {
    shard.rows[l] = shard.images.shape.levels[l].rows / 2;
    PyramidLevel& level = shard.images.levels[l];
    const auto images = static_cast<std::size_t>(shard.rows[l] * shard.images.shape.levels[l].columns);  // of one word each
    level.masks = level.masks.first(images);
    level.mask_ranks = level.mask_ranks.first(images + 1);
    level.block_means = level.block_means.first(level.mask_ranks.back());
  }
  return sample;
}

SamplePyramidShard samplePyramidShardWithNormals(int size) {
  SamplePyramidShard sample = samplePyramidShard(size);
  sample.whole.kept = sampleNearNormals(size, NearType::f32);
  const std::span<const Vec2> normals = sample.whole.kept.normals;
  sample.shard.near_normals = {NearType::i16, size / 2, normals.first(static_cast<std::size_t>(size) * size / 2)};
  return sample;
}

SampleTinyExample sampleTinyExample(int size, TinyMode mode) {
  SampleTinyExample sample;
  sample.normals = sampleNormals(size, size, false).normals;
  TinyExample& tiny = sample.example;
  tiny.mode = mode;
  tiny.background_sigma_r = 0.125f;
  if (mode == TinyMode::scattered) {
    tiny.transforms = {
        .scale = {0.5f, 1.5f}, .stretch = {1, 1.25f}, .shear = {-0.25f, 0}, .rotation_rad = {0, 6.25f}, .mirror = 0.5f};
    tiny.density = 1.5f;
    tiny.overlap = TinyOverlap::nearest;
    tiny.seed = 7;
  }
  PyramidShape& shape = sample.images.pyramid.shape;
  shape = sampleShape(size);
  shape.level_count = 0;
  const int levels = mode == TinyMode::scattered ? 1 : 0;
  for (int side = 2; side <= size << levels; side *= 2)
    shape.levels[shape.level_count++] = {static_cast<float>(side), std::max(1, size / side), std::max(1, size / side)};
  sample.images.pyramid.value_scale = 4;
  sample.images.levels.resize(static_cast<std::size_t>(shape.level_count));
  const double pixel_area = 4.0 / (kResolution * kResolution);
  for (int l = 0; l < shape.level_count; ++l) {
    // Each texel fills the pixel of its normal: no lobe, but images that integrate to 1.
    const int columns = shape.levels[l].columns, side = size / columns;
    std::vector<Image> images(static_cast<std::size_t>(columns) * static_cast<std::size_t>(columns));
    for (Image& image : images) image.assign(static_cast<std::size_t>(kResolution) * kResolution, 0);
    for (int j = 0; j < size; ++j) {
      for (int i = 0; i < size; ++i) {
        const Vec2 n =
            sample.normals[static_cast<std::size_t>(j) * static_cast<std::size_t>(size) + static_cast<std::size_t>(i)];
        const auto pixel = [](float x) {
          return std::clamp(static_cast<int>((x + 1) * 0.5f * kResolution), 0, kResolution - 1);
        };
        images[static_cast<std::size_t>(j / side * columns + i / side)]
              [static_cast<std::size_t>(pixel(n.y) * kResolution + pixel(n.x))] += 1 / (pixel_area * side * side);
      }
    }
    addLevel(sample.images, l, images);
  }
  tiny.images = sample.images.pyramid;
  tiny.normals = sample.normals;
  return sample;
}

namespace {

/// Wavelengths and colours of channels, which sum to white.
void fillChannels(int channels, std::vector<float>& wavelengths_um, std::vector<Rgb>& channel_rgb) {
  for (int k = 0; k < channels; ++k) {
    wavelengths_um.push_back(0.4f + 0.0625f * static_cast<float>(k));
    const float even = 1 / static_cast<float>(channels), lean = k == 0 ? 0.5f : k == 1 ? -0.5f : 0.0f;
    channel_rgb.push_back({even + lean, even, even - lean});
  }
}

}  // namespace

SampleWavePyramid sampleWavePyramid(int size, WaveChannels meaning, BlockPrecision precision) {
  SampleWavePyramid sample;
  sample.grey = samplePyramid(size, precision);
  WavePyramid& wave = sample.wave;
  wave.grey = sample.grey.pyramid;
  wave.meaning = meaning;
  const std::vector<float> shares =
      meaning == WaveChannels::xyz ? std::vector{1.25f, 1.0f, 0.75f} : std::vector{0.5f, 0.75f, 1.0f, 1.25f, 1.5f};
  wave.channels = static_cast<int>(shares.size());
  wave.texel_size_um = 1;
  wave.coherence_um = 8;
  fillChannels(wave.channels, sample.wavelengths_um, sample.channel_rgb);
  wave.wavelengths_um = sample.wavelengths_um;
  wave.channel_rgb = sample.channel_rgb;
  for (std::size_t l = 0; l < sample.grey.levels.size(); ++l) {
    std::vector<std::uint16_t>& halves = sample.halves.emplace_back();
    std::vector<float>& floats = sample.floats.emplace_back();
    const std::vector<float>& grey = sample.grey.levels[l].floats;
    for (std::size_t row = 0; row < grey.size(); row += kBlockSize)
      for (const float share : shares)
        for (std::size_t k = row; k < row + kBlockSize; ++k) {
          floats.push_back(share * grey[k]);
          halves.push_back(floatToHalf(share * grey[k]));
        }
    wave.pixels[l] = precision == BlockPrecision::f16 ? static_cast<const void*>(halves.data()) : floats.data();
  }
  return sample;
}

namespace {

/// @param level_images  [levels][images]
SampleNdfCp ndfCpOf(const PyramidShape& shape, std::vector<std::vector<Image>> level_images, CompressionMethod method,
                    CoefficientType type, SampleForm form) {
  SampleNdfCp sample;
  NdfCp& ndf = sample.ndf;
  ndf.shape = shape;
  ndf.method = method;
  ndf.coefficient_type = type;
  ndf.regions = 2;
  ndf.places = ndf.shape.blocksPerImage();
  for (std::uint16_t block = 0; block < ndf.places; ++block) {
    sample.block_places.push_back(block);
    sample.place_blocks.push_back(block);
  }
  if (form == SampleForm::spots) {
    for (int k = 0; k < kSpotSums; ++k) {
      const double pixels = static_cast<double>(k - kSpotSums / 2) / kSpotSteps;
      sample.spot_sums.push_back(static_cast<float>(0.5 * std::erfc(-pixels / (kSampleSpot * std::sqrt(2.0)))));
    }
  }
  std::vector<Image> images;
  std::vector<std::vector<std::size_t>> region_images(2);
  for (int l = 0; l < ndf.shape.level_count; ++l) {
    ndf.first_image[l] = static_cast<std::uint32_t>(images.size());
    const PyramidGrid& grid = ndf.shape.levels[l];
    for (Image& image : level_images[static_cast<std::size_t>(l)]) {
      const int column = static_cast<int>(images.size() - ndf.first_image[l]) % grid.columns;
      const std::size_t region = 2 * column + 1 >= grid.columns;
      sample.image_regions.push_back(static_cast<std::uint16_t>(region));
      sample.image_slots.push_back(static_cast<std::uint16_t>(region_images[region].size()));
      region_images[region].push_back(images.size());
      images.push_back(std::move(image));
    }
  }
  for (const auto& members : region_images) {
    std::vector<const Image*> slots;
    for (const std::size_t image : members) slots.push_back(&images[image]);
    for (int block = 0; block < ndf.shape.blocksPerImage(); ++block) addCluster(sample, slots, block, form);
  }
  sample.coefficients_i8.resize(type == CoefficientType::i8 ? sample.coefficients_i8.size() + kRowPadding : 0);
  sample.coefficients_f16.resize(type == CoefficientType::f16 ? sample.coefficients_f16.size() + kRowPadding : 0);
  sample.coefficients_f32.resize(type == CoefficientType::f32 ? sample.coefficients_f32.size() + kRowPadding : 0);
  sample.image_scales.assign(images.size(), 1);
  linkSpans(sample);
  for (std::size_t k = 0; k < images.size(); ++k) {
    double sum = 0;
    for (int p = 0; p < kResolution * kResolution; ++p)
      sum += ndfCpPixel(ndf, static_cast<int>(k), p % kResolution, p / kResolution);
    sample.image_scales[k] = static_cast<float>(kResolution * kResolution / 4 / sum);
  }
  addBlockMasses(sample);
  linkSpans(sample);
  return sample;
}

}  // namespace

SampleNdfCp sampleNdfCp(int size, CompressionMethod method, CoefficientType type, SampleForm form) {
  const SampleNormals normals = sampleNormals(size, size, false);
  const PyramidShape shape = sampleShape(size);
  std::vector<std::vector<Image>> images;
  for (int l = 0; l < shape.level_count; ++l) images.push_back(levelImages(normals.map, shape.levels[l]));
  return ndfCpOf(shape, std::move(images), method, type, form);
}

namespace {

void addCompact(std::uint64_t value, int shift, std::vector<std::uint64_t>& bases, std::vector<std::uint16_t>& offsets) {
  if (offsets.size() % (std::size_t{1} << shift) == 0) bases.push_back(value);
  offsets.push_back(static_cast<std::uint16_t>(value - bases.back()));
}

/// Mean and covariance of places in a block, in its sides.
void addMoments(const TexelCode& code, const std::vector<std::uint32_t>& texels, std::vector<std::uint16_t>& moments) {
  const double step = 1.0 / (1 << code.subbin_bits), n = static_cast<double>(texels.size());
  double x = 0, y = 0, xx = 0, xy = 0, yy = 0;
  for (const std::uint32_t t : texels) {
    const double px = (code.subbinX(t) + 0.5) * step, py = (code.subbinY(t) + 0.5) * step;
    x += px / n, y += py / n, xx += px * px / n, xy += px * py / n, yy += py * py / n;
  }
  for (const double v : {x, y, xx - x * x, xy - x * y, yy - y * y}) moments.push_back(floatToHalf(static_cast<float>(v)));
}

/// Lists the texels whose normals are in a square of bins as a block of the sample.
void addBlock(const SampleNormals& normals, int width, int bins, int column, int row, int side_bits, int cell_bits,
              std::size_t node, SampleBinMap& sample) {
  constexpr int kShift = 2;
  const TexelCode map_code = texelCode(width, static_cast<int>(normals.normals.size()) / width);
  cell_bits = std::min(cell_bits, map_code.column_bits + map_code.row_bits);
  const TexelCode code = blockCode(map_code, side_bits, cell_bits);
  const CellGrid grid = cellGrid(map_code, cell_bits);
  std::vector<std::uint32_t> list;
  const std::size_t first_cell = sample.cell_offsets.size();
  for (int cell = 0; cell < 1 << cell_bits; ++cell) {
    addCompact(sample.texels.size() + list.size(), kShift, sample.cell_bases, sample.cell_offsets);
    for (std::size_t t = 0; t < normals.normals.size(); ++t) {
      const int i = static_cast<int>(t) % width, j = static_cast<int>(t) / width;
      if ((j >> grid.row_shift) * grid.columns + (i >> grid.column_shift) != cell) continue;
      const double scale = std::exp2(-side_bits);
      const double x = ((normals.normals[t].x + 1.0) * bins / 2 - column) * scale;
      const double y = ((normals.normals[t].y + 1.0) * bins / 2 - row) * scale;
      if (x < 0 || x >= 1 || y < 0 || y >= 1) continue;
      const auto place = [&](double v) { return static_cast<std::uint32_t>(v * (1 << code.subbin_bits)); };
      list.push_back(code.pack(static_cast<std::uint32_t>(i & ((1 << grid.column_shift) - 1)),
                               static_cast<std::uint32_t>(j & ((1 << grid.row_shift) - 1)), place(x), place(y)));
    }
  }
  if (list.empty()) {
    sample.cell_offsets.resize(first_cell);
    sample.cell_bases.resize((first_cell + (1 << kShift) - 1) >> kShift);
    return;
  }
  sample.nodes[2 * node] = static_cast<std::uint32_t>(cell_bits + 1) |
                           static_cast<std::uint32_t>(sample.block_moments.size() / 5) << BinMap::kKindBits;
  sample.nodes[2 * node + 1] = static_cast<std::uint32_t>(first_cell);
  addMoments(code, list, sample.block_moments);
  sample.texels.insert(sample.texels.end(), list.begin(), list.end());
}

}  // namespace

SampleBinMap sampleBinMap(int width, int height) {
  constexpr int kBins = 9, kTileBits = 2, kTiles = 3, kShift = 2;
  const SampleNormals normals = sampleNormals(width, height, false);
  SampleBinMap sample;
  sample.texel_classes.assign((normals.normals.size() * BinMap::kClassBits + 15) / 16, 0);
  for (std::size_t t = 0; t < normals.normals.size(); ++t) {
    const auto column = static_cast<std::size_t>((normals.normals[t].x + 1.0) * kBins / 2);
    const auto row = static_cast<std::size_t>((normals.normals[t].y + 1.0) * kBins / 2);
    // Classes are quarters of tiles.
    const std::size_t quarter =
        4 * ((row >> kTileBits) * kTiles + (column >> kTileBits)) + (row >> 1 & 1) * 2 + (column >> 1 & 1);
    for (std::size_t k = 0; k < BinMap::kClassBits; ++k) {
      const std::size_t bit = t * BinMap::kClassBits + k;
      sample.texel_classes[bit / 16] |= static_cast<std::uint16_t>((quarter >> k & 1) << (bit % 16));
    }
  }
  for (std::uint32_t quarter = 0; quarter <= 4 * kTiles * kTiles; ++quarter) sample.class_keys.push_back(4 * quarter);
  sample.nodes.assign(2 * kTiles * kTiles, 0);
  for (int tile = 0; tile < kTiles * kTiles; ++tile) {
    const int column = tile % kTiles << kTileBits, row = tile / kTiles << kTileBits;
    if (tile != 4) {
      addBlock(normals, width, kBins, column, row, kTileBits, 3, static_cast<std::size_t>(tile), sample);
      continue;
    }
    const std::size_t first_child = sample.nodes.size() / 2;
    sample.nodes[2 * static_cast<std::size_t>(tile)] = BinMap::kSplit;
    sample.nodes[2 * static_cast<std::size_t>(tile) + 1] = static_cast<std::uint32_t>(first_child);
    sample.nodes.resize(sample.nodes.size() + 8);
    for (int quadrant = 0; quadrant < 4; ++quadrant)
      addBlock(normals, width, kBins, column + 2 * (quadrant & 1), row + 2 * (quadrant >> 1), kTileBits - 1, 2,
               first_child + static_cast<std::size_t>(quadrant), sample);
  }
  addCompact(sample.texels.size(), kShift, sample.cell_bases, sample.cell_offsets);
  sample.map = {width,
                height,
                0.4f,
                0.4f,
                0.8f,
                {{0.25f, -0.125f}, {0.5f, 0.125f, 0.25f}},
                kBins,
                8,
                kTileBits,
                sample.nodes,
                sample.block_moments,
                {sample.cell_bases, sample.cell_offsets, kShift},
                sample.texels,
                sample.class_keys,
                sample.texel_classes};
  return sample;
}

SampleHistograms sampleHistograms(int width, int height) {
  constexpr int kRings = 12;
  constexpr int kSectors = 8;
  constexpr double kPi = 3.14159265358979323846;
  const SampleNormals map = sampleNormals(width, height, false);
  const auto direction = [](Vec2 n) {
    const double phi = std::atan2(double{n.y}, double{n.x});
    const int ring = static_cast<int>(std::asin(std::sqrt(double{n.x} * n.x + double{n.y} * n.y)) / (kPi / 2) * kRings);
    return ring * kSectors + std::min(static_cast<int>((phi < 0 ? phi + 2 * kPi : phi) / (2 * kPi) * kSectors), kSectors - 1);
  };
  SampleHistograms sample;
  HistogramSat& sat = sample.sat;
  sat.width = width, sat.height = height, sat.theta_bins = kRings, sat.phi_bins = kSectors;
  sat.stride = 4, sat.coarse_stride = 8, sat.line_stride = 16;
  sat.slopes = {{0.125f, -0.0625f}, {0.25f, 0.03125f, 0.5f}};
  sample.texels.resize(static_cast<std::size_t>(sat.tileRows()) * sat.tileColumns() * 64);
  for (int id = 0; id < kRings * kSectors; ++id) {
    double x = 0, y = 0, p = 0, q = 0, pp = 0, pq = 0, qq = 0;
    std::uint64_t count = 0;
    for (int j = 0; j < height; ++j) {
      for (int i = 0; i < width; ++i) {
        if (direction(map.map.at(i, j)) != id) continue;
        sample.texels[sat.texelIndex(i, j)] = static_cast<std::uint16_t>(sample.bin_ids.size());
        const Vec2 n = map.map.at(i, j);
        x += n.x, y += n.y, ++count;
        const double nz = std::sqrt(1 - double{n.x} * n.x - double{n.y} * n.y), sp = -n.x / nz, sq = -n.y / nz;
        p += sp, q += sq, pp += sp * sp, pq += sp * sq, qq += sq * sq;
      }
    }
    if (count == 0) continue;
    sample.bin_ids.push_back(static_cast<std::uint16_t>(id));
    const auto texels = static_cast<double>(count);
    sample.bin_normals.push_back({static_cast<float>(x / texels), static_cast<float>(y / texels)});
    p /= texels, q /= texels;
    const double xx = std::max(0.0, pp / texels - p * p), yy = std::max(0.0, qq / texels - q * q);
    const double most = 0.999 * std::sqrt(xx * yy);
    sample.bin_slopes.push_back(
        {{static_cast<float>(p), static_cast<float>(q)},
         {static_cast<float>(xx), static_cast<float>(std::clamp(pq / texels - p * q, -most, most)), static_cast<float>(yy)}});
    sample.bin_totals.push_back(count);
  }
  sat.bin_count = static_cast<int>(sample.bin_ids.size());
  const auto count = [&](auto& table, int x0, int y0, int x1, int y1) {
    const std::size_t point = table.size();
    table.resize(point + sat.rowLength());
    for (int j = y0; j < y1; ++j)
      for (int i = x0; i < x1; ++i) ++table[point + sample.texels[sat.texelIndex(i, j)]];
  };
  const auto tableOf = [&](auto& table, int stride) {
    for (int b = 0; b < sat.pointsY(stride); ++b)
      for (int a = 0; a < sat.pointsX(stride); ++a)
        count(table, 0, 0, std::min(a * stride, width), std::min(b * stride, height));
  };
  tableOf(sample.sums, sat.stride);
  tableOf(sample.coarse_sums, sat.coarse_stride);
  for (int j = 0; j < height; ++j)
    for (int a = 0; a < sat.pointsX(16); ++a) count(sample.row_sums, 0, j, std::min(a * 16, width), j + 1);
  for (int i = 0; i < width; ++i)
    for (int b = 0; b < sat.pointsY(16); ++b) count(sample.column_sums, i, 0, i + 1, std::min(b * 16, height));
  sat.bin_ids = sample.bin_ids, sat.bin_normals = sample.bin_normals, sat.bin_slopes = sample.bin_slopes,
  sat.bin_totals = sample.bin_totals;
  sat.texels = sample.texels, sat.sums = sample.sums, sat.coarse_sums = sample.coarse_sums;
  sat.row_sums = sample.row_sums, sat.column_sums = sample.column_sums;
  return sample;
}

SampleSlopeMoments sampleSlopeMoments(int width, int height) {
  SampleSlopeMoments sample;
  SlopeMoments& moments = sample.moments;
  moments.width = width, moments.height = height, moments.finest_level = 1;
  // Means along u in even steps around 0. Coarser texels hold the mixture of two.
  int columns = width / 2, rows = height / 2;
  float step = 0.5f / static_cast<float>(columns), variance = 1.0f / 64;
  for (;; columns = std::max(1, columns / 2), rows = std::max(1, rows / 2)) {
    std::vector<MapSlopes>& texels = sample.texels.emplace_back();
    for (int j = 0; j < rows; ++j)
      for (int i = 0; i < columns; ++i)
        texels.push_back(
            {{step * (static_cast<float>(i) - 0.5f * static_cast<float>(columns - 1)), 0.25f}, {variance, 0, 1.0f / 32}});
    moments.levels[moments.level_count++] = {columns, rows, {}};
    if (columns * rows == 1) break;
    if (columns > 1) variance += 0.25f * step * step, step *= 2;
  }
  for (int l = 0; l < moments.level_count; ++l) moments.levels[l].texels = sample.texels[static_cast<std::size_t>(l)];
  moments.slopes = sample.texels.back()[0];
  return sample;
}

SampleWangTiles sampleWangTiles(WangScheme scheme) {
  SampleWangTiles sample;
  WangTiles& tiles = sample.tiles;
  tiles.size = WangTiles::kLeastSize, tiles.scheme = scheme;
  tiles.colors_h = tiles.colors_v = 2, tiles.tile_count = 16;
  tiles.plane_seed = 7, tiles.texel_size_um = 2;
  tiles.seam_cost = 1.5f, tiles.ndf_tv = 0.125f, tiles.repetition = 0.25f;
  const int last = tiles.size - 1;
  for (int t = 0; t < tiles.tile_count; ++t) {
    const WangColors colors = tiles.colorsOfTile(t);
    for (int j = 0; j <= last; ++j)
      for (int i = 0; i <= last; ++i) {
        // Scheme corner: the colour of the nearest corner. Scheme edge: that of the nearest edge.
        const bool east = 2 * i > last, north = 2 * j > last;
        const int to_u = east ? last - i : i, to_v = north ? last - j : j;
        const std::size_t corner = (north ? 2u : 0u) + (east ? 1u : 0u);
        const std::size_t side = to_v <= to_u ? (north ? 1u : 0u) : (east ? 3u : 2u);
        const int color = colors[scheme == WangScheme::corner ? corner : side];
        sample.normals.push_back({color == 0 ? 0.25f : -0.25f, static_cast<float>((i + 3 * j) % 5 - 2) / 8});
      }
  }
  tiles.normals = sample.normals;
  tiles.slopes = slopeSums(sample.normals.data(), sample.normals.size()).moments(static_cast<double>(sample.normals.size()));
  return sample;
}

namespace {

/// A plane whose tiles have one centre each.
/// @param margin  images beyond every border, 0 or 1
void fillPlane(int margin, WangImages& plane, PyramidShape& shape, std::vector<float>& masses) {
  plane.tiles = sampleWangTiles().tiles;
  plane.tiles.normals = {};
  shape = sampleShape(plane.tiles.size);
  shape.boundary = Boundary::clamp;
  shape.level_count = 2;
  plane.grids[0] = {1, margin, {}}, plane.grids[1] = {1, 0, {}};
  const int side = plane.grids[0].side();
  shape.levels[0] = {static_cast<float>(plane.tiles.size), side, plane.tiles.tile_count * side};
  shape.levels[1] = {2.0f * static_cast<float>(plane.tiles.size), 1, 1};
  if (margin == 1) masses = {0.125f, 0.75f, 0.125f, 1};
  if (margin == 0) masses = {1, 1};
}
void linkMasses(const std::vector<float>& masses, WangImages& plane) {
  plane.grids[0].masses = {masses.data(), masses.size() - 1};
  plane.grids[1].masses = {masses.data() + masses.size() - 1, 1};
}
/// Images of one even block each.
std::vector<Image> blockImages(std::size_t count) {
  constexpr int kBlocks = kResolution / kBlockSize;
  std::vector<Image> images(count);
  for (std::size_t k = 0; k < count; ++k) {
    images[k].assign(static_cast<std::size_t>(kResolution) * kResolution, 0);
    const int block = static_cast<int>(k % (kBlocks * kBlocks));
    for (int y = 0; y < kBlockSize; ++y)
      for (int x = 0; x < kBlockSize; ++x)
        images[k]
              [static_cast<std::size_t>((block / kBlocks * kBlockSize + y) * kResolution + block % kBlocks * kBlockSize + x)] =
                  kBlocks * kBlocks / 4.0f;
  }
  return images;
}

}  // namespace

SampleWangPyramid sampleWangPyramid() {
  SampleWangPyramid sample;
  NdfPyramid& pyramid = sample.images.pyramid;
  fillPlane(1, sample.asset.plane, pyramid.shape, sample.masses);
  pyramid.value_scale = 4;
  sample.images.levels.resize(static_cast<std::size_t>(pyramid.shape.level_count));
  for (int l = 0; l < pyramid.shape.level_count; ++l)
    addLevel(sample.images, l, blockImages(pyramid.shape.levels[l].imageCount()));
  sample.asset.images = pyramid;
  linkMasses(sample.masses, sample.asset.plane);
  return sample;
}

SampleWaveCp sampleWaveCp(int size, WaveChannels meaning) {
  SampleWaveCp sample;
  WaveCp& wave = sample.wave;
  wave.meaning = meaning;
  wave.channels = meaning == WaveChannels::xyz ? 3 : 5;
  wave.texel_size_um = 1;
  wave.coherence_um = 8;
  fillChannels(wave.channels, sample.wavelengths_um, sample.channel_rgb);
  wave.wavelengths_um = sample.wavelengths_um;
  wave.channel_rgb = sample.channel_rgb;
  wave.shape = sampleShape(size);
  const SampleNormals normals = sampleNormals(size, size, false);
  std::vector<std::vector<Image>> images;
  for (int l = 0; l < wave.shape.level_count; ++l) {
    std::vector<Image>& level = images.emplace_back();
    for (int c = 0; c < wave.channels; ++c)
      for (Image& image : levelImages(normals.map, wave.shape.levels[l])) {
        for (auto row = image.begin(); row != image.end(); row += kResolution) std::rotate(row, row + 4 * c, row + kResolution);
        level.push_back(std::move(image));
      }
  }
  sample.images = ndfCpOf(channelShape(wave.shape, wave.channels), std::move(images), CompressionMethod::tucker,
                          CoefficientType::i8, SampleForm::wide);
  wave.images = sample.images.ndf;
  return sample;
}

SampleWangCp sampleWangCp() {
  SampleWangCp sample;
  PyramidShape shape;
  fillPlane(0, sample.asset.plane, shape, sample.masses);
  std::vector<std::vector<Image>> images;
  for (int l = 0; l < shape.level_count; ++l) images.push_back(blockImages(shape.levels[l].imageCount()));
  sample.images = ndfCpOf(shape, std::move(images), CompressionMethod::tucker, CoefficientType::i8, SampleForm::wide);
  sample.asset.images = sample.images.ndf;
  linkMasses(sample.masses, sample.asset.plane);
  return sample;
}

SampleShLobes sampleShLobes() {
  SampleShLobes s;
  s.zonal = {0.28f, 0.4f};
  for (int row = 0; row < 3; ++row) {
    for (int column = 0; column < 4; ++column) {
      // Directions along the axes: sqrt(4 pi / 3) y_1 is the direction itself, in the order z, x, y.
      constexpr float kAzimuths[4][2] = {{1, 0}, {0, 1}, {-1, 0}, {0, -1}};
      const float sine = row == 1 ? 1.0f : 0.0f, cosine = 1.0f - static_cast<float>(row);
      s.coefficients.insert(s.coefficients.end(), {s.zonal[0], s.zonal[1] * cosine, s.zonal[1] * sine * kAzimuths[column][0],
                                                   s.zonal[1] * sine * kAzimuths[column][1]});
    }
  }
  s.lobes = {1, 0.1f, {3, 4}, ShPrecision::f32, s.zonal, s.coefficients.data()};
  return s;
}

SampleShLight sampleShLight() {
  SampleShLight s;
  // Integrals of 4 z P_l(z) over z in [0, 1], times 2 pi sqrt((2l + 1) / (4 pi)).
  constexpr double kPi = 3.14159265358979323846;
  const double bands[3] = {2, 4.0 / 3, 0.5};
  for (int direction = 0; direction < 12; ++direction) {
    s.scales.push_back(0.5f);
    for (int channel = 1; channel <= 3; ++channel) {
      for (int l = 0; l < 3; ++l) {
        const double zonal = bands[l] * 2 * kPi * std::sqrt((2 * l + 1) / (4 * kPi));
        const std::uint16_t stored = floatToHalf(static_cast<float>(2 * channel * zonal));
        s.coefficients.push_back(stored);
        s.coefficients.insert(s.coefficients.end(), static_cast<std::size_t>(2 * l), 0);
        if (channel == 3) s.band_norms.push_back(static_cast<float>(3 * zonal));
      }
    }
  }
  s.light = {2, {3, 4}, ShPrecision::f16, s.scales, s.band_norms, s.coefficients.data()};
  return s;
}

namespace {

/// An asset that is a member of its sample.
template <class Sample, class Model>
OwnedAsset owned(Sample sample, Model Sample::*member) {
  const auto memory = std::make_shared<const Sample>(std::move(sample));
  return {(*memory).*member, memory};
}

template <CompressionMethod kMethod, CoefficientType kType, SampleForm kForm = SampleForm::wide>
OwnedAsset ownedNdfCp() {
  return owned(sampleNdfCp(64, kMethod, kType, kForm), &SampleNdfCp::ndf);
}

}  // namespace

std::vector<SampleAsset> sampleAssets() {
  using enum CompressionMethod;
  using enum CoefficientType;
  return {
      {"bin-map", [] { return owned(sampleBinMap(64, 48), &SampleBinMap::map); }},
      {"displacement", [] { return owned(sampleDisplacement(64), &SampleDisplacement::displacement); }},
      {"displacement-rgb", [] { return owned(sampleDisplacement(64, true), &SampleDisplacement::displacement); }},
      {"heights", [] { return owned(sampleHeights(64, 48), &SampleHeights::map); }},
      {"histogram-sat", [] { return owned(sampleHistograms(22, 19), &SampleHistograms::sat); }},
      {"ndf-cp-cp-i8", ownedNdfCp<cp, i8>},
      {"ndf-cp-tucker-f16", ownedNdfCp<tucker, f16>},
      {"ndf-cp-pca-i8", ownedNdfCp<pca, i8>},
      {"ndf-cp-narrow-i8", ownedNdfCp<tucker, i8, SampleForm::narrow>},
      {"ndf-cp-spots-i8", ownedNdfCp<tucker, i8, SampleForm::spots>},
      {"ndf-cp-cp-f32", ownedNdfCp<cp, f32>},
      {"ndf-pyramid", [] { return owned(samplePyramid(64, BlockPrecision::f16), &SamplePyramid::pyramid); }},
      {"ndf-cp-normals-f32", [] { return owned(sampleNdfCpWithNormals(32, NearType::f32), &SampleNdfCp::ndf); }},
      {"ndf-pyramid-normals-i16", [] { return owned(samplePyramidWithNormals(32, NearType::i16), &SamplePyramid::pyramid); }},
      {"ndf-pyramid-shard", [] { return owned(samplePyramidShard(64), &SamplePyramidShard::shard); }},
      {"ndf-pyramid-shard-normals", [] { return owned(samplePyramidShardWithNormals(32), &SamplePyramidShard::shard); }},
      {"normals", [] { return owned(sampleNormals(64, 48), &SampleNormals::map); }},
      {"sh-light", [] { return owned(sampleShLight(), &SampleShLight::light); }},
      {"sh-lobes", [] { return owned(sampleShLobes(), &SampleShLobes::lobes); }},
      {"slope-moments", [] { return owned(sampleSlopeMoments(9, 4), &SampleSlopeMoments::moments); }},
      {"tiny-example-scattered", [] { return owned(sampleTinyExample(8, TinyMode::scattered), &SampleTinyExample::example); }},
      {"tiny-example-tiled", [] { return owned(sampleTinyExample(8, TinyMode::tiled), &SampleTinyExample::example); }},
      {"wang-cp", [] { return owned(sampleWangCp(), &SampleWangCp::asset); }},
      {"wang-pyramid", [] { return owned(sampleWangPyramid(), &SampleWangPyramid::asset); }},
      {"wang-tiles", [] { return owned(sampleWangTiles(), &SampleWangTiles::tiles); }},
      {"wave-cp", [] { return owned(sampleWaveCp(64, WaveChannels::xyz), &SampleWaveCp::wave); }},
      {"wave-pyramid",
       [] { return owned(sampleWavePyramid(64, WaveChannels::xyz, BlockPrecision::f16), &SampleWavePyramid::wave); }},
  };
}

formats::Provenance sampleProvenance() {
  return {"sample_assets 1.0",
          R"({"size":64})",
          {{"flakes.png", "00112233445566778899aabbccddeeff"}, {"b\u00e4r.exr", "ffeeddccbbaa99887766554433221100"}}};
}

std::uint16_t floatToHalf(float value) {
  const auto bits = std::bit_cast<std::uint32_t>(value);
  const auto sign = static_cast<std::uint16_t>(bits >> 16 & 0x8000u);
  const float magnitude = std::abs(value);
  if (magnitude < 0x1p-14f)
    return static_cast<std::uint16_t>(sign | static_cast<std::uint16_t>(std::lrint(magnitude * 0x1p24f)));
  const std::uint32_t rebased = (bits & 0x7fffffffu) - (112u << 23);
  const std::uint32_t rounded = rebased + 0xfffu + (rebased >> 13 & 1u);
  return static_cast<std::uint16_t>(sign | std::min(rounded >> 13, 0x7c00u));
}

float halfToFloat(std::uint16_t bits) {
  const int exponent = bits >> 10 & 31;
  const float mantissa = static_cast<float>(bits & 0x3ff);
  const float magnitude = exponent == 0 ? mantissa * 0x1p-24f : std::ldexp(1024 + mantissa, exponent - 25);
  return (bits & 0x8000) != 0 ? -magnitude : magnitude;
}

float pyramidPixel(const NdfPyramid& pyramid, int level, int image, int x, int y) {
  const PyramidLevel& data = pyramid.levels[level];
  const int block = y / kBlockSize * pyramid.shape.blocksPerAxis() + x / kBlockSize;
  const std::uint64_t* mask =
      &data.masks[static_cast<std::size_t>(image) * static_cast<std::size_t>(pyramid.shape.maskWords())];
  if ((mask[block / 64] >> (block % 64) & 1u) == 0) return 0;
  std::uint64_t index = data.mask_ranks[static_cast<std::size_t>(image) * static_cast<std::size_t>(pyramid.shape.maskWords())];
  for (int b = 0; b < block; ++b) index += mask[b / 64] >> (b % 64) & 1u;
  index = index * kBlockPixels + static_cast<std::uint64_t>(y % kBlockSize * kBlockSize + x % kBlockSize);
  const float stored = pyramid.precision == BlockPrecision::f16
                           ? halfToFloat(static_cast<const std::uint16_t*>(data.pixels)[index])
                           : static_cast<const float*>(data.pixels)[index];
  return pyramid.value_scale * stored;
}

float ndfCpFloor(const NdfCp& ndf, int image, int x, int y) {
  const std::size_t c = clusterOf(ndf, image, x, y);
  const auto cell =
      static_cast<std::size_t>(y % kBlockSize / kFloorPixels * (kBlockSize / kFloorPixels) + x % kBlockSize / kFloorPixels);
  return halfToFloat(ndf.clusters[c].floor_unit) *
         halfToFloat(static_cast<std::uint16_t>(ndf.floors[c * kFloorCells + cell] << 6));
}

float ndfCpPixel(const NdfCp& ndf, int image, int x, int y) {
  const auto k = static_cast<std::size_t>(image);
  const NdfCluster& cluster = ndf.clusters[clusterOf(ndf, image, x, y)];
  const int slot = ndf.image_slots[k];
  const std::size_t word = cluster.first_word + static_cast<std::size_t>(slot / 64);
  if ((ndf.masks[word] >> (slot % 64) & 1u) == 0) return 0;
  const std::uint64_t below = ndf.masks[word] & ((std::uint64_t{1} << (slot % 64)) - 1);
  const auto slice = ndf.mask_ranks[word] + static_cast<std::uint64_t>(std::popcount(below));
  double density = cluster.columns == 0 ? spotValue(ndf, cluster, slice, x % kBlockSize, y % kBlockSize) : 0;
  for (int column = 0; column < cluster.columns; ++column)
    density += ndf.scales[cluster.first_scale + static_cast<std::uint64_t>(column)] *
               coefficientValue(ndf, cluster, slice, column) * basisValue(ndf, cluster, column, x % kBlockSize, y % kBlockSize);
  return static_cast<float>(density * ndf.image_scales[k]);
}

}  // namespace glint::test
