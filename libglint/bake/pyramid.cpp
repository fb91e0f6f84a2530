#include "glint/bake/pyramid.h"

#include <tbb/enumerable_thread_specific.h>
#include <tbb/parallel_for.h>

#include <algorithm>
#include <cmath>
#include <mutex>
#include <string>

#include "glint/bake/direction_bins.h"
#include "glint/bake/flat_scatter.h"
#include "glint/bake/pyramid_agreement.h"
#include "glint/bake/simd.h"
#include "glint/bake/slopes.h"
#include "glint/bake/smooth_scatter.h"
#include "glint/model/error.h"
#include "glint/query/half.h"

namespace glint::bake {
namespace {

void require(bool ok, const char* option, const std::string& range) {
  if (!ok) throw Error(ErrorCode::usage, "option.range", {}, option, "out of range", "give " + range);
}

void checkOptions(const NormalMap& map, const PyramidOptions& o) {
  require(o.stride >= 2 && o.stride <= 65536, "--stride", "2 to 65536 texels");
  require(o.resolution >= 32 && o.resolution <= 1024 && o.resolution % kBlockSize == 0, "--resolution",
          "a multiple of 16 from 32 to 1024");
  const float pixel = 2.0f / static_cast<float>(o.resolution);
  require(o.sigma_r >= 0.1f * pixel && o.sigma_r <= 0.25f, "--sigma-r",
          std::to_string(0.1f * pixel) + " (a tenth of a pixel; raise --resolution for less) to 0.25");
  require(o.levels >= 0 && o.levels <= kMaxPyramidLevels, "--levels", "auto or 1 to " + std::to_string(kMaxPyramidLevels));
  if (map.width < 1 || map.height < 1) throw Error(ErrorCode::invalid_input, "normals.size", {}, {}, "the map has no texels");
}

/// One image with its empty blocks left out, before it is packed with its level.
struct PackedImage {
  std::vector<std::uint64_t> mask;
  std::vector<float> means;
  std::vector<std::uint16_t> half_pixels;
  std::vector<float> float_pixels;
};

/// Sum of the pixels of a block: of each column first, which the processor adds side by side.
GLINT_MULTIVERSION float sumBlock(const float* pixels) {
  float columns[kBlockSize] = {};
  for (int y = 0; y < kBlockSize; ++y)
    for (int x = 0; x < kBlockSize; ++x) columns[x] += pixels[y * kBlockSize + x];
  float sum = 0;
  for (const float c : columns) sum += c;
  return sum;
}

GLINT_MULTIVERSION void toHalf(const float* from, float scale, std::uint16_t* to, float* rounded) {
  for (int k = 0; k < kBlockPixels; ++k) {
    to[k] = floatToHalf(scale * from[k]);
    rounded[k] = halfToFloat(to[k]);
  }
}

/// Filters bins into pixels and keeps the blocks that hold something.
class ImagePacker {
 public:
  ImagePacker(const PyramidShape& shape, BlockPrecision precision, float value_scale, const PixelFilter& filter,
              int subdivision)
      : shape_(shape), precision_(precision), filter_(filter), subdivision_(subdivision) {
    const float pixels_per_unit = 0.5f * static_cast<float>(shape.resolution);
    to_stored_ = pixels_per_unit * pixels_per_unit / value_scale;
    value_scale_ = value_scale;
  }

  PackedImage pack(DirectionBins& bins, float inverse_mass) const {
    PackedImage image;
    image.mask.assign(shape_.maskWords(), 0);
    const int blocks = shape_.blocksPerAxis(), size = kBlockSize * subdivision_;
    for (int b = 0; b < blocks * blocks; ++b) {
      if (!bins.touchedNear(b % blocks, b / blocks, filter_.radius() + 1)) continue;
      float pixels[kBlockPixels];
      filter_.filterBlock(bins.origin() + static_cast<std::ptrdiff_t>(b / blocks) * size * bins.pitch() + b % blocks * size,
                          bins.pitch(), pixels);
      if (sumBlock(pixels) * inverse_mass <= kBlockMassThreshold) continue;
      image.mask[b / 64] |= std::uint64_t{1} << (b % 64);
      store(pixels, inverse_mass, image);
    }
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
  const PixelFilter& filter_;
  int subdivision_;
  float to_stored_;
  float value_scale_;
};

NdfPyramidData::Level packLevel(std::vector<PackedImage>& images, BlockPrecision precision) {
  NdfPyramidData::Level level;
  std::size_t blocks = 0;
  level.first_block.push_back(0);
  for (const PackedImage& image : images) level.first_block.push_back(blocks += image.means.size());
  level.block_means.reserve(blocks);
  (precision == BlockPrecision::f16 ? level.half_pixels.reserve(blocks * kBlockPixels)
                                    : level.float_pixels.reserve(blocks * kBlockPixels));
  const auto append = [](auto& to, const auto& from) { to.insert(to.end(), from.begin(), from.end()); };
  for (PackedImage& image : images) {
    append(level.masks, image.mask);
    append(level.block_means, image.means);
    append(level.half_pixels, image.half_pixels);
    append(level.float_pixels, image.float_pixels);
    image = {};  // frees as it goes: the level is held once
  }
  return level;
}

/// Counts images over all levels, from any thread.
class ImageCounter {
 public:
  ImageCounter(const PyramidShape& shape, const ProgressFn& progress) : progress_(progress) {
    for (int l = 0; l < shape.level_count; ++l) total_ += shape.levels[l].imageCount();
  }
  void count() {
    if (!progress_) return;
    const std::scoped_lock lock(mutex_);
    progress_(++done_, total_);
  }

 private:
  const ProgressFn& progress_;
  std::mutex mutex_;
  std::size_t done_ = 0, total_ = 0;
};

struct Scratch {
  Scratch(int resolution, int subdivision, int margin)
      : bins(resolution, subdivision, margin), band(resolution, subdivision, margin) {}
  DirectionBins bins, band;
};

std::vector<std::vector<PackedImage>> buildFlat(const NormalMap& map, const PyramidShape& shape, const ImagePacker& packer,
                                                int subdivision, int margin, const ProgressFn& progress) {
  ImageCounter counter(shape, progress);
  tbb::enumerable_thread_specific<Scratch> scratch([&] { return Scratch(shape.resolution, subdivision, margin); });
  std::vector<std::vector<PackedImage>> images(shape.level_count);
  for (int l = 0; l < shape.level_count; ++l) {
    const PyramidGrid& grid = shape.levels[l];
    images[l].resize(grid.imageCount());
    tbb::parallel_for(std::size_t{0}, grid.imageCount(), [&](std::size_t k) {
      Scratch& s = scratch.local();
      const Vec2 centre = {(static_cast<float>(k % grid.columns) + 0.5f) * grid.stride,
                           (static_cast<float>(k / grid.columns) + 0.5f) * grid.stride};
      scatterFlatFootprint(map, shape.boundary, centre, kFootprintPerStride * grid.stride, s.bins, s.band);
      images[l][k] = packer.pack(s.bins, 1);
      s.bins.clear();
      counter.count();
    });
  }
  return images;
}

/// Copies sparse bins to the raster that the filter reads.
void unpackBins(const BlockBins& sparse, DirectionBins& bins) {
  constexpr int kTile = BlockBins::kTile;
  const int tiles = bins.resolution() * bins.subdivision() / kTile + 2;  // with the margin
  for (std::size_t k = 0; k < sparse.tiles().size(); ++k) {
    const int tx = sparse.tiles()[k] % tiles - 1, ty = sparse.tiles()[k] / tiles - 1;
    float* corner = bins.origin() + static_cast<std::ptrdiff_t>(ty) * kTile * bins.pitch() + tx * kTile;
    for (int y = 0; y < kTile; ++y)
      std::copy_n(sparse.values(k) + y * kTile, kTile, corner + static_cast<std::ptrdiff_t>(y) * bins.pitch());
    const auto touchedTile = [&](int tile) { return std::clamp(tile * kTile / bins.tileSize(), 0, bins.tilesPerAxis() - 1); };
    for (const int x : {touchedTile(tx), touchedTile(tx + 1)})  // tiles here may be larger than those flags
      for (const int y : {touchedTile(ty), touchedTile(ty + 1)}) bins.touched()[y * bins.tilesPerAxis() + x] = 1;
  }
}

std::vector<std::vector<PackedImage>> buildSmooth(const NormalMap& map, const PyramidShape& shape, const ImagePacker& packer,
                                                  int subdivision, int margin, const ProgressFn& progress) {
  tbb::enumerable_thread_specific<DirectionBins> scratch([&] { return DirectionBins(shape.resolution, subdivision, margin); });
  std::vector<std::vector<PackedImage>> images(shape.level_count);
  for (int l = 0; l < shape.level_count; ++l) images[l].resize(shape.levels[l].imageCount());
  scatterSmooth(
      map, shape, subdivision,
      [&](int level, int i, int j, const BlockBins& sparse) {
        DirectionBins& bins = scratch.local();
        unpackBins(sparse, bins);
        images[level][static_cast<std::size_t>(j) * shape.levels[level].columns + i] =
            packer.pack(bins, static_cast<float>(1 / sparse.mass()));
        bins.clear();
      },
      progress);
  return images;
}

/// Drops the coarsest levels while the level below them says the same.
void dropAgreeingLevels(NdfPyramidData& pyramid) {
  while (pyramid.shape.level_count > 1 && levelDisagreement(pyramid.view(), pyramid.shape.level_count - 2) < kAgreement) {
    pyramid.levels.pop_back();
    pyramid.shape.levels[--pyramid.shape.level_count] = {};
  }
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
    v.levels[l] = {level.masks, level.first_block, level.block_means, pixels};
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
  const auto longest = static_cast<float>(std::max(width, height));
  for (float stride = o.stride; shape.level_count < kMaxPyramidLevels; stride *= 2) {
    if (shape.level_count > 0 && stride >= longest) break;
    if (o.levels > 0 && shape.level_count == o.levels) break;
    shape.levels[shape.level_count++] = {stride, static_cast<int>(std::ceil(static_cast<float>(width) / stride)),
                                         static_cast<int>(std::ceil(static_cast<float>(height) / stride))};
  }
  if (shape.level_count < o.levels)
    throw Error(ErrorCode::usage, "option.range", {}, "--levels",
                std::to_string(o.levels) + " levels do not fit: the stride reaches the map",
                "give at most " + std::to_string(shape.level_count) + ", or auto");
  return shape;
}

NdfPyramidData buildPyramid(const NormalMap& map, const PyramidOptions& options, const ProgressFn& progress) {
  checkOptions(map, options);
  NdfPyramidData pyramid;
  pyramid.shape = pyramidShape(map.width, map.height, options);
  pyramid.shape.slopes = mapSlopes(map);
  pyramid.precision = options.precision;
  // Pixel means reach (resolution / 2)^2; half precision ends at 65504.
  pyramid.value_scale =
      options.resolution > 256 ? static_cast<float>(options.resolution * options.resolution) / (256 * 256) : 1;

  const float sigma_pixels = 0.5f * options.sigma_r * static_cast<float>(options.resolution);
  const int subdivision = subdivisionFor(sigma_pixels);
  const PixelFilter filter(sigma_pixels, subdivision, 0.25f);
  const int margin = std::max(filter.radius(), BlockBins::kTile) + 16;  // filters read up to two strips past their reach
  const ImagePacker packer(pyramid.shape, options.precision, pyramid.value_scale, filter, subdivision);
  auto images = options.surface == Surface::flat ? buildFlat(map, pyramid.shape, packer, subdivision, margin, progress)
                                                 : buildSmooth(map, pyramid.shape, packer, subdivision, margin, progress);
  for (auto& level : images) pyramid.levels.push_back(packLevel(level, options.precision));
  if (options.levels == 0) dropAgreeingLevels(pyramid);
  return pyramid;
}

}  // namespace glint::bake
