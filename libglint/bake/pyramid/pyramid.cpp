#include "glint/bake/pyramid/pyramid.h"

#include <fmt/format.h>
#include <tbb/enumerable_thread_specific.h>
#include <tbb/parallel_for.h>

#include <algorithm>
#include <cmath>
#include <span>
#include <string>
#include <utility>

#include "glint/bake/common/slopes.h"
#include "glint/bake/pyramid/agreement.h"
#include "glint/bake/pyramid/direction_bins.h"
#include "glint/bake/pyramid/flat_scatter.h"
#include "glint/bake/pyramid/image_bytes.h"
#include "glint/bake/pyramid/image_packer.h"
#include "glint/bake/pyramid/smooth_scatter.h"
#include "glint/model/error.h"
#include "glint/query/detail/common/footprint_weights.h"

namespace glint::bake {
namespace {

/// The last level is the mean of the map.
constexpr int kMaxFootprintLevels = kMaxPyramidLevels - 1;

void require(bool ok, const char* option, const std::string& range) {
  if (!ok) throw Error(ErrorCode::usage, "option.range", {}, option, "out of range", "give " + range);
}

/// Adds the level that is the mean of the map.
void appendMean(PyramidShape& shape) {
  shape.levels[shape.level_count] = {2 * shape.levels[shape.level_count - 1].stride, 1, 1};
  ++shape.level_count;
}

/// Bins of one thread.
struct Scratch {
  Scratch(int resolution, const PixelFilter& filter)
      : bins(resolution, filter.subdivision(), filter.margin()), band(resolution, filter.subdivision(), filter.margin()) {}
  DirectionBins bins, band;
};

void checkTexels(const NormalMap& map) {
  if (map.width < 1 || map.height < 1) throw Error(ErrorCode::invalid_input, "normals.size", {}, {}, "the map has no texels");
}

/// Makes one image of a flat surface.
PackedImage flatImage(const NormalMap& map, const PyramidShape& shape, int level, std::size_t image, const ImagePacker& packer,
                      const PixelFilter& filter, Scratch& s) {
  const PyramidGrid& grid = shape.levels[level];
  const Vec2 centre = shape.centre(level, static_cast<int>(image % grid.columns), static_cast<int>(image / grid.columns));
  if (level < shape.footprintLevels())
    scatterFlatFootprint(map, shape.boundary, centre, kFootprintPerStride * grid.stride, s.bins, s.band);
  else
    scatterFlatMap(map, s.bins, s.band);
  const Layer layer = {&s.bins, &filter};
  PackedImage packed = packer.pack({&layer, 1}, 1);
  s.bins.clear();
  return packed;
}

/// The images of a level that a region has.
struct RegionImages {
  std::size_t first, count;
};
RegionImages imagesOf(const PyramidShape& shape, int level, PyramidRegion region) {
  const ImageRows rows = regionRows(shape, level, region);
  const auto columns = static_cast<std::size_t>(shape.levels[level].columns);
  return {static_cast<std::size_t>(rows.first) * columns, static_cast<std::size_t>(rows.count()) * columns};
}

/// Makes the images of all levels of a flat surface.
/// @return [levels][images]
std::vector<std::vector<PackedImage>> buildFlat(const NormalMap& map, const PyramidShape& shape, PyramidRegion region,
                                                const ImagePacker& packer, const PixelFilter& filter,
                                                const ProgressFn& progress) {
  std::size_t total = 0;
  for (int l = 0; l < shape.level_count; ++l) total += imagesOf(shape, l, region).count;
  ProgressCounter counter(progress, total);
  tbb::enumerable_thread_specific<Scratch> scratch([&] { return Scratch(shape.resolution, filter); });
  std::vector<std::vector<PackedImage>> images(shape.level_count);
  for (int l = 0; l < shape.level_count; ++l) {
    const RegionImages part = imagesOf(shape, l, region);
    images[l].resize(part.count);
    tbb::parallel_for(std::size_t{0}, part.count, [&](std::size_t k) {
      images[l][k] = flatImage(map, shape, l, part.first + k, packer, filter, scratch.local());
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
std::vector<std::vector<PackedImage>> buildSmooth(const NormalMap& map, const PyramidShape& shape, PyramidRegion region,
                                                  const ImagePacker& packer, const ProgressFn& progress) {
  const float sigma_pixels = 0.5f * shape.sigma_r * static_cast<float>(shape.resolution);
  // The coarse grid has half the bins along each axis.
  const int subdivision = 2 * ((subdivisionFor(sigma_pixels) + 1) / 2);
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
  for (int l = 0; l < shape.level_count; ++l) images[l].resize(imagesOf(shape, l, region).count);
  scatterSmooth(
      map, shape, region, tiles,
      [&](int level, int i, int j, const BlockBins& sparse) {
        auto& [fine, coarse] = scratch.local();
        unpackBins(sparse, tiles.fine, fine);
        unpackBins(sparse, tiles.coarse, coarse);
        const Layer layers[] = {{&fine, &fine_filter}, {&coarse, &coarse_filter}};
        images[level][static_cast<std::size_t>(j) * shape.levels[level].columns + i - imagesOf(shape, level, region).first] =
            packer.pack(layers, static_cast<float>(1 / sparse.sum()));
        fine.clear();
        coarse.clear();
      },
      progress);
  return images;
}

/// Drops the coarsest level of footprints while the next finer level agrees with it. The mean of the map stays the last level.
void dropAgreeingLevels(NdfPyramidData& pyramid) {
  const NdfPyramid view = pyramid.view();
  const int kept = disagreeingLevels(pyramid.shape, [&](int level, std::size_t image, std::vector<float>& pixels) {
    decodeImage(view, level, image, pixels);
  });
  pyramid.levels.erase(pyramid.levels.begin() + kept, pyramid.levels.end() - 1);
  keepLevels(pyramid.shape, kept);
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
    shape.levels[shape.level_count++] = shape.gridOf(stride);
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

void checkPyramidOptions(const PyramidOptions& o) {
  require(o.stride >= 2 && o.stride <= 65536, "--stride", "2 to 65536 texels");
  require(o.overlap >= 1 && o.overlap <= kMostOverlap, "--overlap", "1 to 4 footprints in a stride");
  require(o.resolution >= kLeastResolution && o.resolution <= kMostResolution && o.resolution % kBlockSize == 0, "--resolution",
          "auto, or a multiple of 16 from 32 to 1024");
  const float pixel = 2.0f / static_cast<float>(o.resolution);
  require(o.sigma_r >= 0.1f * pixel && o.sigma_r <= 0.25f, "--sigma-r",
          fmt::format("{:.4g}", 0.1f * pixel) + " (a tenth of a pixel; raise --resolution for less) to 0.25");
  require(o.levels >= 0 && o.levels <= kMaxFootprintLevels, "--levels", "auto or 1 to " + std::to_string(kMaxFootprintLevels));
}

double pyramidBytes(const NormalMap& map, const PyramidOptions& options, double most_bytes, PyramidRegion region) {
  // Triangles of smooth surfaces lie between the blocks of their corners.
  const double spread = options.surface == Surface::smooth ? 4 : 1;
  checkPyramidOptions(options);
  checkTexels(map);
  const PyramidShape shape = pyramidShape(map.width, map.height, options);
  const PixelFilter filter = flatFilter(options);
  const ImagePacker packer(shape, BlockPrecision::f16, 1);
  Scratch scratch(options.resolution, filter);
  return imageBytes(
      shape, options.precision, most_bytes,
      [&](int level, std::size_t image) { return flatImage(map, shape, level, image, packer, filter, scratch).means.size(); },
      spread, region);
}

NdfPyramidData buildPyramid(const NormalMap& map, const PyramidOptions& options, const ProgressFn& progress) {
  NdfPyramidShardData whole = buildPyramidShard(map, options, {}, progress);
  if (whole.level_choice == LevelChoice::agreeing) dropAgreeingLevels(whole.images);
  return std::move(whole.images);
}

NdfPyramidShardData buildPyramidShard(const NormalMap& map, const PyramidOptions& options, PyramidRegion region,
                                      const ProgressFn& progress) {
  checkPyramidOptions(options);
  checkTexels(map);
  NdfPyramidShardData shard = {{}, region, options.levels == 0 ? LevelChoice::agreeing : LevelChoice::given};
  NdfPyramidData& pyramid = shard.images;
  pyramid.shape = pyramidShape(map.width, map.height, options);
  pyramid.shape.slopes = mapSlopes(map);
  pyramid.precision = options.precision;
  pyramid.value_scale = valueScaleFor(options.resolution);
  const ImagePacker packer(pyramid.shape, options.precision, pyramid.value_scale);
  auto images = options.surface == Surface::flat ? buildFlat(map, pyramid.shape, region, packer, flatFilter(options), progress)
                                                 : buildSmooth(map, pyramid.shape, region, packer, progress);
  pyramid.levels.resize(images.size());
  tbb::parallel_for(std::size_t{0}, images.size(),
                    [&](std::size_t l) { pyramid.levels[l] = packLevel(images[l], options.precision); });
  return shard;
}

NdfPyramidShard NdfPyramidShardData::view() const {
  NdfPyramidShard v;
  v.region = region;
  v.level_choice = level_choice;
  for (int l = 0; l < images.shape.level_count; ++l) v.rows[l] = regionRows(images.shape, l, region).count();
  v.images = images.view();
  return v;
}

std::vector<std::uint8_t> rowsReached(const PyramidShape& shape, PyramidRegion region) {
  const bool smooth = shape.surface == Surface::smooth;
  // A smooth surface that is wider than high is turned as a whole.
  const bool all = smooth && shape.width > shape.height;
  std::vector<std::uint8_t> reached(static_cast<std::size_t>(shape.height), all ? 1 : 0);
  for (int l = 0; l < shape.level_count && !all; ++l) {
    const float stride = shape.levels[l].stride;
    // Smooth: two cells of an eighth of a stride, and the neighbours of their outermost texels.
    const float reach = kPyramidReach * kFootprintPerStride * stride + (smooth ? 2 * stride / 8 + 2 : 0);
    const ImageRows rows = regionRows(shape, l, region);
    for (int j = rows.first; j < rows.end; ++j) {
      const float centre = shape.centre(l, 0, j).y;
      int first = static_cast<int>(std::floor(centre - reach)), end = static_cast<int>(std::ceil(centre + reach)) + 1;
      if (l >= shape.footprintLevels() || end - first >= shape.height) first = 0, end = shape.height;
      for (int y = first; y < end; ++y) {
        if (shape.boundary == Boundary::clamp && (y < 0 || y >= shape.height)) continue;
        reached[static_cast<std::size_t>(wrapIndex(y, shape.height))] = 1;
      }
    }
  }
  return reached;
}

}  // namespace glint::bake
