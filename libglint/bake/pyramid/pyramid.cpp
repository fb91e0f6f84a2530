#include "glint/bake/pyramid/pyramid.h"

#include <fmt/format.h>
#include <tbb/enumerable_thread_specific.h>
#include <tbb/parallel_for.h>

#ifdef __x86_64__
#include <immintrin.h>
#endif

#include <algorithm>
#include <array>
#include <bit>
#include <cmath>
#include <span>
#include <string>

#include "glint/bake/common/simd.h"
#include "glint/bake/common/slopes.h"
#include "glint/bake/pyramid/agreement.h"
#include "glint/bake/pyramid/direction_bins.h"
#include "glint/bake/pyramid/flat_scatter.h"
#include "glint/bake/pyramid/smooth_scatter.h"
#include "glint/math/half.h"
#include "glint/model/error.h"

namespace glint::bake {
namespace {

/// The last level is the mean of the map.
constexpr int kMaxFootprintLevels = kMaxPyramidLevels - 1;

void require(bool ok, const char* option, const std::string& range) {
  if (!ok) throw Error(ErrorCode::usage, "option.range", {}, option, "out of range", "give " + range);
}

void checkOptions(const NormalMap& map, const PyramidOptions& o) {
  require(o.stride >= 2 && o.stride <= 65536, "--stride", "2 to 65536 texels");
  require(o.overlap >= 1 && o.overlap <= kMostOverlap, "--overlap", "1 to 4 footprints in a stride");
  require(o.resolution >= kLeastResolution && o.resolution <= kMostResolution && o.resolution % kBlockSize == 0, "--resolution",
          "auto, or a multiple of 16 from 32 to 1024");
  const float pixel = 2.0f / static_cast<float>(o.resolution);
  require(o.sigma_r >= 0.1f * pixel && o.sigma_r <= 0.25f, "--sigma-r",
          fmt::format("{:.4g}", 0.1f * pixel) + " (a tenth of a pixel; raise --resolution for less) to 0.25");
  require(o.levels >= 0 && o.levels <= kMaxFootprintLevels, "--levels", "auto or 1 to " + std::to_string(kMaxFootprintLevels));
  if (map.width < 1 || map.height < 1) throw Error(ErrorCode::invalid_input, "normals.size", {}, {}, "the map has no texels");
}

/// The blocks of one image that are stored, before its level is packed.
struct PackedImage {
  std::vector<std::uint64_t> mask;
  std::vector<float> means;
  std::vector<std::uint16_t> half_pixels;
  std::vector<float> float_pixels;
};

/// Sum of the pixels of a block: first of each column, with one lane of a vector for each, then of the columns.
GLINT_MULTIVERSION float sumBlock(const float* pixels) {
  float columns[kBlockSize] = {};
  for (int y = 0; y < kBlockSize; ++y)
    for (int x = 0; x < kBlockSize; ++x) columns[x] += pixels[y * kBlockSize + x];
  float sum = 0;
  for (const float c : columns) sum += c;
  return sum;
}

void toHalfPortably(const float* from, float scale, std::uint16_t* to, float* rounded) {
  for (int k = 0; k < kBlockPixels; ++k) {
    to[k] = floatToHalf(scale * from[k]);
    rounded[k] = halfToFloat(to[k]);
  }
}

#ifdef __x86_64__
/// toHalfPortably with the processor's own conversion, which gives the same bits.
__attribute__((target("avx,f16c"))) void toHalfByInstruction(const float* from, float scale, std::uint16_t* to,
                                                             float* rounded) {
  const __m256 scales = _mm256_set1_ps(scale), largest = _mm256_set1_ps(65504);
  for (int k = 0; k < kBlockPixels; k += 8) {
    const __m256 values = _mm256_min_ps(_mm256_mul_ps(scales, _mm256_loadu_ps(from + k)), largest);
    const __m128i halves = _mm256_cvtps_ph(values, _MM_FROUND_TO_NEAREST_INT);
    _mm_storeu_si128(reinterpret_cast<__m128i*>(to + k), halves);
    _mm256_storeu_ps(rounded + k, _mm256_cvtph_ps(halves));
  }
}
#endif

/// Converts scale * from, which is not negative, to half precision.
/// @param rounded  [kBlockPixels]: the halves, converted back to float
void toHalf(const float* from, float scale, std::uint16_t* to, float* rounded) {
#ifdef __x86_64__
  static const bool has_instruction = __builtin_cpu_supports("avx") && __builtin_cpu_supports("f16c");
  if (has_instruction) return toHalfByInstruction(from, scale, to, rounded);
#endif
  toHalfPortably(from, scale, to, rounded);
}

/// Bins, and the filter that makes pixels of them.
struct Layer {
  DirectionBins* bins;
  const PixelFilter* filter;
};

/// Adds the level that is the mean of the map.
void appendMean(PyramidShape& shape) {
  shape.levels[shape.level_count] = {2 * shape.levels[shape.level_count - 1].stride, 1, 1};
  ++shape.level_count;
}

/// Filters bins into pixels, and keeps the blocks that have enough mass.
class ImagePacker {
 public:
  ImagePacker(const PyramidShape& shape, BlockPrecision precision, float value_scale) : shape_(shape), precision_(precision) {
    const float pixels_per_unit = 0.5f * static_cast<float>(shape.resolution);
    to_stored_ = pixels_per_unit * pixels_per_unit / value_scale;
    value_scale_ = value_scale;
  }

  /// Makes one image.
  /// @param layers        bins; the pixels of all layers are added
  /// @param inverse_mass  1 over the mass of all bins
  PackedImage pack(std::span<const Layer> layers, float inverse_mass) const {
    PackedImage image;
    image.mask.assign(shape_.maskWords(), 0);
    const int blocks = shape_.blocksPerAxis();
    std::vector<std::array<float, kBlockPixels>> stored;
    float excess = 0;  // mass that is added by setting negative pixels to 0
    for (int b = 0; b < blocks * blocks; ++b) {
      std::array<float, kBlockPixels> pixels = {};
      bool empty = true;
      for (const auto& [bins, filter] : layers) {
        if (!bins->touchedNear(b % blocks, b / blocks, filter->radius() + 1)) continue;
        const int size = kBlockSize * bins->subdivision();
        filter->addBlock(bins->origin() + static_cast<std::ptrdiff_t>(b / blocks) * size * bins->pitch() + b % blocks * size,
                         bins->pitch(), pixels.data());
        empty = false;
      }
      if (empty) continue;
      const float mass = sumBlock(pixels.data());
      for (float& pixel : pixels) pixel = std::max(pixel, 0.0f);
      const float kept = sumBlock(pixels.data());
      excess += kept - mass;
      if (kept * inverse_mass <= kBlockMassThreshold) continue;
      image.mask[b / 64] |= std::uint64_t{1} << (b % 64);
      stored.push_back(pixels);
    }
    // Normalise to the mass with the excess, so that the image integrates to 1.
    const float scale = inverse_mass / (1 + excess * inverse_mass);
    image.means.reserve(stored.size());
    (precision_ == BlockPrecision::f16 ? image.half_pixels.reserve(stored.size() * kBlockPixels)
                                       : image.float_pixels.reserve(stored.size() * kBlockPixels));
    for (const auto& pixels : stored) store(pixels.data(), scale, image);
    return image;
  }

 private:
  void store(const float* pixels, float inverse_mass, PackedImage& image) const {
    float stored[kBlockPixels];
    if (precision_ == BlockPrecision::f16) {
      image.half_pixels.resize(image.half_pixels.size() + kBlockPixels);
      toHalf(pixels, to_stored_ * inverse_mass, image.half_pixels.data() + image.half_pixels.size() - kBlockPixels, stored);
    } else {
      for (int k = 0; k < kBlockPixels; ++k) stored[k] = to_stored_ * inverse_mass * pixels[k];
      image.float_pixels.insert(image.float_pixels.end(), stored, stored + kBlockPixels);
    }
    image.means.push_back(value_scale_ * sumBlock(stored) / kBlockPixels);
  }

  const PyramidShape& shape_;
  BlockPrecision precision_;
  float to_stored_;
  float value_scale_;
};

/// Joins the images of a level.
NdfPyramidData::Level packLevel(std::vector<PackedImage>& images, BlockPrecision precision) {
  NdfPyramidData::Level level;
  std::size_t blocks = 0;
  for (const PackedImage& image : images) {
    for (const std::uint64_t word : image.mask) {
      level.mask_ranks.push_back(static_cast<std::uint32_t>(blocks));
      blocks += static_cast<std::size_t>(std::popcount(word));
    }
  }
  level.mask_ranks.push_back(static_cast<std::uint32_t>(blocks));
  level.block_means.reserve(blocks);
  (precision == BlockPrecision::f16 ? level.half_pixels.reserve(blocks * kBlockPixels)
                                    : level.float_pixels.reserve(blocks * kBlockPixels));
  const auto append = [](auto& to, const auto& from) { to.insert(to.end(), from.begin(), from.end()); };
  for (PackedImage& image : images) {
    append(level.masks, image.mask);
    append(level.block_means, image.means);
    append(level.half_pixels, image.half_pixels);
    append(level.float_pixels, image.float_pixels);
    image = {};  // frees the memory of the image, so that the level is in memory once
  }
  return level;
}

/// Bins of one thread.
struct Scratch {
  Scratch(int resolution, const PixelFilter& filter)
      : bins(resolution, filter.subdivision(), filter.margin()), band(resolution, filter.subdivision(), filter.margin()) {}
  DirectionBins bins, band;
};

/// Makes the images of all levels of a flat surface.
/// @return [levels][images]
std::vector<std::vector<PackedImage>> buildFlat(const NormalMap& map, const PyramidShape& shape, const ImagePacker& packer,
                                                const PixelFilter& filter, const ProgressFn& progress) {
  std::size_t total = 0;
  for (int l = 0; l < shape.level_count; ++l) total += shape.levels[l].imageCount();
  ProgressCounter counter(progress, total);
  tbb::enumerable_thread_specific<Scratch> scratch([&] { return Scratch(shape.resolution, filter); });
  std::vector<std::vector<PackedImage>> images(shape.level_count);
  for (int l = 0; l < shape.level_count; ++l) {
    const PyramidGrid& grid = shape.levels[l];
    images[l].resize(grid.imageCount());
    tbb::parallel_for(std::size_t{0}, grid.imageCount(), [&](std::size_t k) {
      Scratch& s = scratch.local();
      const Vec2 centre = shape.centre(l, static_cast<int>(k % grid.columns), static_cast<int>(k / grid.columns));
      if (l < shape.footprintLevels())
        scatterFlatFootprint(map, shape.boundary, centre, kFootprintPerStride * grid.stride, s.bins, s.band);
      else
        scatterFlatMap(map, s.bins, s.band);
      const Layer layer = {&s.bins, &filter};
      images[l][k] = packer.pack({&layer, 1}, 1);
      s.bins.clear();
      counter.advance();
    });
  }
  return images;
}

/// Copies the tiles of one grid from sparse bins to the raster that the filter reads, and flags its tiles.
void unpackBins(const BlockBins& sparse, const DirectionTiles::Grid& grid, DirectionBins& bins) {
  constexpr int kTile = BlockBins::kTile;
  const auto touchedTile = [&](int bin) { return std::clamp(bin / bins.tileSize(), 0, bins.tilesPerAxis() - 1); };
  for (std::size_t k = 0; k < sparse.tiles().size(); ++k) {
    const int tile = sparse.tiles()[k] - grid.first;
    if (tile < 0 || tile >= grid.end() - grid.first) continue;
    const int left = (tile % grid.tilesPerAxis() - 1) * kTile, bottom = (tile / grid.tilesPerAxis() - 1) * kTile;
    float* corner = bins.origin() + static_cast<std::ptrdiff_t>(bottom) * bins.pitch() + left;
    for (int y = 0; y < kTile; ++y)
      std::copy_n(sparse.values(k) + y * kTile, kTile, corner + static_cast<std::ptrdiff_t>(y) * bins.pitch());
    for (int y = touchedTile(bottom); y <= touchedTile(bottom + kTile - 1); ++y)
      for (int x = touchedTile(left); x <= touchedTile(left + kTile - 1); ++x) bins.touched()[y * bins.tilesPerAxis() + x] = 1;
  }
}

/// Makes the images of all levels of a smooth surface, from a fine and a coarse grid of bins.
/// @return [levels][images]
std::vector<std::vector<PackedImage>> buildSmooth(const NormalMap& map, const PyramidShape& shape, const ImagePacker& packer,
                                                  int subdivision, const ProgressFn& progress) {
  const float sigma_pixels = 0.5f * shape.sigma_r * static_cast<float>(shape.resolution);
  const PixelFilter fine_filter(sigma_pixels, subdivision, Spline::cubic);
  const PixelFilter coarse_filter(sigma_pixels, subdivision / 2, Spline::cubic);
  const DirectionTiles tiles(shape.resolution * subdivision);
  struct Rasters {
    DirectionBins fine, coarse;
  };
  tbb::enumerable_thread_specific<Rasters> scratch([&] {
    return Rasters{DirectionBins(shape.resolution, subdivision, fine_filter.margin()),
                   DirectionBins(shape.resolution, subdivision / 2, coarse_filter.margin())};
  });
  std::vector<std::vector<PackedImage>> images(shape.level_count);
  for (int l = 0; l < shape.level_count; ++l) images[l].resize(shape.levels[l].imageCount());
  scatterSmooth(
      map, shape, tiles,
      [&](int level, int i, int j, const BlockBins& sparse) {
        auto& [fine, coarse] = scratch.local();
        unpackBins(sparse, tiles.fine, fine);
        unpackBins(sparse, tiles.coarse, coarse);
        const Layer layers[] = {{&fine, &fine_filter}, {&coarse, &coarse_filter}};
        images[level][static_cast<std::size_t>(j) * shape.levels[level].columns + i] =
            packer.pack(layers, static_cast<float>(1 / sparse.sum()));
        fine.clear();
        coarse.clear();
      },
      progress);
  return images;
}

/// Drops the coarsest level of footprints while the next finer level agrees with it. The mean of the map stays the last level.
void dropAgreeingLevels(NdfPyramidData& pyramid) {
  PyramidShape& shape = pyramid.shape;
  int kept = shape.footprintLevels();
  while (kept > 1 && levelDisagreement(pyramid.view(), kept - 2) < kAgreement) --kept;
  pyramid.levels.erase(pyramid.levels.begin() + kept, pyramid.levels.end() - 1);
  for (int l = kept; l < shape.level_count; ++l) shape.levels[l] = {};
  shape.level_count = kept;
  appendMean(shape);
}

}  // namespace

NdfPyramid NdfPyramidData::view() const {
  NdfPyramid v;
  v.shape = shape;
  v.precision = precision;
  v.value_scale = value_scale;
  for (std::size_t l = 0; l < levels.size(); ++l) {
    const Level& level = levels[l];
    const void* pixels =
        precision == BlockPrecision::f16 ? static_cast<const void*>(level.half_pixels.data()) : level.float_pixels.data();
    v.levels[l] = {level.masks, level.mask_ranks, level.block_means, pixels};
  }
  return v;
}

PyramidShape pyramidShape(int width, int height, const PyramidOptions& o) {
  PyramidShape shape;
  shape.width = width;
  shape.height = height;
  shape.resolution = o.resolution;
  shape.sigma_r = o.sigma_r;
  shape.surface = o.surface;
  shape.boundary = o.boundary;
  shape.overlap = o.overlap;
  const auto longest = static_cast<float>(std::max(width, height));
  for (float stride = o.stride; shape.level_count < kMaxFootprintLevels; stride *= 2) {
    if (shape.level_count > 0 && stride >= longest) break;
    if (o.levels > 0 && shape.level_count == o.levels) break;
    shape.levels[shape.level_count++] = {stride, shape.centresAlong(width, stride), shape.centresAlong(height, stride)};
  }
  if (shape.level_count < o.levels)
    throw Error(ErrorCode::usage, "option.range", {}, "--levels",
                std::to_string(o.levels) + " levels do not fit: the stride reaches the map",
                "give at most " + std::to_string(shape.level_count) + ", or auto");
  appendMean(shape);
  return shape;
}

int resolutionFor(float sigma_r) {
  constexpr float kResolvedPixels = 1.5f;
  const float pixels = std::clamp(2 * kResolvedPixels / sigma_r, float{kLeastResolution}, float{kMostResolution});
  return static_cast<int>(std::ceil(pixels / kBlockSize)) * kBlockSize;
}

double pyramidBytes(const NormalMap& map, const PyramidOptions& options, double most_bytes) {
  // Images are packed while others of their level still have their own arrays, which grew by doubling.
  constexpr double kCopies = 2.5;
  constexpr std::size_t kSampledImages = 8;  // of a level
  // Triangles of smooth surfaces lie between the blocks of their corners.
  const double spread = options.surface == Surface::smooth ? 4 : 1;
  checkOptions(map, options);
  PyramidShape shape = pyramidShape(map.width, map.height, options);
  const double block_bytes = kBlockPixels * (options.precision == BlockPrecision::f16 ? 2.0 : 4.0) + sizeof(float);
  const double empty_image = static_cast<double>(sizeof(PackedImage)) + static_cast<double>(shape.maskWords()) * 24;
  double full = 0, counted = 0;
  for (int l = 0; l < shape.level_count; ++l)
    full += static_cast<double>(shape.levels[l].imageCount()) * (empty_image + shape.blocksPerImage() * block_bytes * kCopies);
  if (full <= most_bytes) return full;

  const float sigma_pixels = 0.5f * options.sigma_r * static_cast<float>(options.resolution);
  const PixelFilter filter(sigma_pixels, subdivisionFor(sigma_pixels), Spline::quadratic);
  const ImagePacker packer(shape, BlockPrecision::f16, 1);
  Scratch scratch(options.resolution, filter);
  const Layer layer = {&scratch.bins, &filter};
  for (int l = 0; l < shape.footprintLevels(); ++l) {
    const PyramidGrid& grid = shape.levels[l];
    const std::size_t samples = std::min(kSampledImages, grid.imageCount());
    double blocks = 0;
    for (std::size_t k = 0; k < samples; ++k) {
      const std::size_t image = (2 * k + 1) * grid.imageCount() / (2 * samples);
      const Vec2 centre = shape.centre(l, static_cast<int>(image % grid.columns), static_cast<int>(image / grid.columns));
      scatterFlatFootprint(map, shape.boundary, centre, kFootprintPerStride * grid.stride, scratch.bins, scratch.band);
      blocks += static_cast<double>(packer.pack({&layer, 1}, 1).means.size());
      scratch.bins.clear();
    }
    const double blocks_per_image = std::min<double>(shape.blocksPerImage(), spread * blocks / static_cast<double>(samples));
    counted += static_cast<double>(grid.imageCount()) * (empty_image + blocks_per_image * block_bytes * kCopies);
  }
  return counted;
}

NdfPyramidData buildPyramid(const NormalMap& map, const PyramidOptions& options, const ProgressFn& progress) {
  checkOptions(map, options);
  NdfPyramidData pyramid;
  pyramid.shape = pyramidShape(map.width, map.height, options);
  pyramid.shape.slopes = mapSlopes(map);
  pyramid.precision = options.precision;
  // A pixel mean can reach (resolution / 2)^2, and the largest half is 65504: scale down images of more than 256 pixels.
  pyramid.value_scale =
      options.resolution > 256 ? static_cast<float>(options.resolution * options.resolution) / (256 * 256) : 1;

  const float sigma_pixels = 0.5f * options.sigma_r * static_cast<float>(options.resolution);
  const int subdivision = subdivisionFor(sigma_pixels);
  const ImagePacker packer(pyramid.shape, options.precision, pyramid.value_scale);
  // The coarse grid of smooth surfaces has half the bins along each axis, so the subdivision must be even.
  auto images = options.surface == Surface::flat
                    ? buildFlat(map, pyramid.shape, packer, PixelFilter(sigma_pixels, subdivision, Spline::quadratic), progress)
                    : buildSmooth(map, pyramid.shape, packer, subdivision + subdivision % 2, progress);
  pyramid.levels.resize(images.size());
  tbb::parallel_for(std::size_t{0}, images.size(),
                    [&](std::size_t l) { pyramid.levels[l] = packLevel(images[l], options.precision); });
  if (options.levels == 0) dropAgreeingLevels(pyramid);
  return pyramid;
}

}  // namespace glint::bake
