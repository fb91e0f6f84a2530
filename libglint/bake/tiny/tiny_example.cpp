#include "glint/bake/tiny/tiny_example.h"

#include <fmt/format.h>
#include <tbb/enumerable_thread_specific.h>
#include <tbb/parallel_for.h>

#include <algorithm>
#include <bit>
#include <cmath>
#include <string>

#include "glint/bake/common/counter_random.h"
#include "glint/bake/tiny/explicit_map.h"
#include "glint/bake/tiny/tile_image.h"
#include "glint/model/error.h"
#include "glint/model/slope_sums.h"
#include "glint/query/detail/tiny/normal_turn.h"

namespace glint::bake {
namespace {

/// Points of a plane whose mean is that of the plane; fewer where lobes are so wide that each costs much.
constexpr double kMostMeanPoints = 1 << 17, kLeastMeanPoints = 1 << 12, kMeanWork = 4e8;
/// Cells from which these points come, along each axis.
constexpr std::int64_t kMeanCells = 1 << 20;
/// Points along each axis of a texel of a smooth surface, at most.
constexpr int kMostPoints = 32;

void require(bool ok, const char* option, const std::string& range) {
  if (!ok) throw Error(ErrorCode::usage, "option.range", {}, option, "out of range", "give " + range);
}

/// A normal that rounding has moved over the rim of the disk, inside.
Vec2 insideDisk(Vec2 n) {
  constexpr float kMost = 1 - 0x1p-22f;
  const float square = dot(n, n);
  return square > kMost ? std::sqrt(kMost / square) * n : n;
}

void checkExample(const NormalMap& map) {
  const int n = map.width;
  const bool fits = n == map.height && n >= TinyExample::kLeastSize && n <= TinyExample::kMostSize &&
                    std::has_single_bit(static_cast<unsigned>(n));
  if (fits) return;
  throw Error(ErrorCode::invalid_input, "tiny.size", {}, {},
              fmt::format("the map has {} x {} texels, and an example has 2, 4, 8, 16, 32, 64, 128 or 256 along both axes",
                          map.width, map.height),
              "cut one from it with --cut, such as --cut 16");
}

void checkTransforms(const TinyOptions& o) {
  if (o.mode == TinyMode::tiled) {
    const Matrix2& m = o.matrix;
    const float size = std::max({std::fabs(m.xx), std::fabs(m.xy), std::fabs(m.yx), std::fabs(m.yy)});
    constexpr float kThinnest = 1e-3f;  // of the determinant of a matrix of this size
    const float determinant = std::fabs(m.determinant());
    if (size > TinyExample::kMostMatrix)
      throw Error(ErrorCode::usage, "tiny.transform", {}, "--transforms", fmt::format("the matrix has a number of {:g}", size),
                  fmt::format("give one whose numbers are at most {:g}", TinyExample::kMostMatrix));
    if (!(std::isfinite(size) && determinant > kThinnest * size * size && determinant >= TinyExample::kLeastDeterminant))
      throw Error(ErrorCode::usage, "tiny.transform", {}, "--transforms", "the matrix is singular, or nearly so",
                  "give one whose determinant is not 0");
    return;
  }
  const float reach = o.transforms.reach();
  if (!(reach <= TinyExample::kMostReach))
    throw Error(ErrorCode::usage, "tiny.reach", {}, "--transforms",
                fmt::format("examples reach {:.2g} cells from their centre", reach),
                fmt::format("give a smaller scale, stretch or shear: at most {:.2g} cells", TinyExample::kMostReach));
  const float sigma = TinyExample::sigmaInCells(o.density, reach);
  if (!(sigma >= TinyExample::kLeastSigmaInCells))
    throw Error(
        ErrorCode::usage, "tiny.density", {}, "--density",
        fmt::format("with {} examples in a cell that reach {:.2g} cells, too many lie over one point", o.density, reach),
        "give fewer or smaller examples");
}

void checkOptions(const TinyOptions& o) {
  require(o.resolution >= kLeastResolution && o.resolution <= kMostResolution && o.resolution % kBlockSize == 0, "--resolution",
          "auto, or a multiple of 16 from 32 to 1024");
  const float pixel = 2.0f / static_cast<float>(o.resolution);
  require(o.sigma_r >= 0.1f * pixel && o.sigma_r <= 0.25f, "--sigma-r",
          fmt::format("{:.4g}", 0.1f * pixel) + " (a tenth of a pixel; raise --resolution for less) to 0.25");
  require(o.heights > 0, "--transforms", "heights above 0: others turn normals inside out");
  require(o.density >= TinyExample::kLeastDensity && o.density <= TinyExample::kMostDensity, "--density",
          fmt::format("{} to {} examples in a cell", TinyExample::kLeastDensity, TinyExample::kMostDensity));
  checkTransforms(o);
}

PyramidShape imagesShape(const TinyOptions& o, int size) {
  PyramidShape shape;
  shape.width = shape.height = size;
  shape.resolution = o.resolution;
  shape.sigma_r = o.sigma_r;
  shape.surface = o.surface;
  for (int side = 2; side <= size; side *= 2)
    shape.levels[shape.level_count++] = {static_cast<float>(side), size / side, size / side};
  if (o.mode == TinyMode::scattered) shape.levels[shape.level_count++] = {static_cast<float>(2 * size), 1, 1};
  return shape;
}

/// Points along each axis of a texel, so that neighbours are less than a deviation of a lobe apart.
int pointsPerTexel(const TinyExample& example) {
  if (example.images.shape.surface == Surface::flat) return 1;
  const int n = example.size();
  const bool wraps = example.mode == TinyMode::tiled;
  float longest = 0;
  for (int j = 0; j < n; ++j) {
    for (int i = 0; i < n; ++i) {
      const Vec2 here = example.normals[rowMajorIndex(i, j, n)];
      const auto step = [&](int x, int y) {
        const Vec2 d = example.normals[rowMajorIndex(x % n, y % n, n)] - here;
        longest = std::max(longest, dot(d, d));
      };
      if (i + 1 < n || wraps) step(i + 1, j);
      if (j + 1 < n || wraps) step(i, j + 1);
    }
  }
  return std::clamp(static_cast<int>(std::ceil(std::sqrt(longest) / example.images.shape.sigma_r)) + 1, 2, kMostPoints);
}

/// Adds the facets of a square of texels.
void addTile(const TinyExample& example, int left, int bottom, int side, int points, TileImage& image) {
  for (int j = 0; j < side * points; ++j)
    for (int i = 0; i < side * points; ++i)
      image.add(exampleNormal(example, left + (i + 0.5) / points, bottom + (j + 0.5) / points), 1);
}

/// Makes the images of all levels of the example.
void buildLevels(const TinyExample& example, const TinyExampleData& data, ProgressCounter& counter,
                 std::vector<NdfPyramidData::Level>& levels) {
  const PyramidShape& shape = example.images.shape;
  const int points = pointsPerTexel(example);
  tbb::enumerable_thread_specific<TileImage> scratch([&] { return TileImage(shape.resolution, shape.sigma_r); });
  for (int l = 0; l < example.exampleLevels(); ++l) {
    const int columns = shape.levels[l].columns, side = 2 << l;
    std::vector<StoredImage> images(shape.levels[l].imageCount());
    tbb::parallel_for(0, columns * columns, [&](int k) {
      TileImage& image = scratch.local();
      image.clear();
      addTile(example, k % columns * side, k / columns * side, side, points, image);
      images[static_cast<std::size_t>(k)] = storeImage(image, shape, data.images.precision, data.images.value_scale);
      counter.advance();
    });
    levels.push_back(joinImages(images));
  }
}

/// What is seen at many points of the plane.
struct PlanePoints {
  std::vector<Vec2> normals;  ///< of points that an example covers
  std::size_t background = 0;
};

PlanePoints lookAtPlane(const TinyExample& example, std::size_t count) {
  const TinySurface surface(example);
  const auto n = static_cast<float>(example.size());
  std::vector<TinySurface::Seen> seen(count);
  tbb::parallel_for(std::size_t{0}, count, [&](std::size_t k) {
    const std::uint64_t cell = randomBits(static_cast<std::uint64_t>(example.seed), 1, k);
    const Vec2 xi = randomPair(static_cast<std::uint64_t>(example.seed), 2, k);
    const auto centred = [](std::uint64_t bits) { return static_cast<std::int64_t>(bits % (2 * kMeanCells)) - kMeanCells; };
    seen[k] = surface.at({centred(cell), centred(cell >> 32), {n * xi.x, n * xi.y}});
  });
  PlanePoints points;
  for (const TinySurface::Seen& s : seen) {
    if (s.background)
      ++points.background;
    else
      points.normals.push_back(s.normal);
  }
  return points;
}

/// Makes the image that is the mean of a plane of scattered examples, and the slopes of the plane.
void addPlaneMean(const TinyExample& example, TinyExampleData& data) {
  const PyramidShape& shape = example.images.shape;
  TileImage image(shape.resolution, shape.sigma_r);
  TileImage background(shape.resolution, example.background_sigma_r);
  const double pixels = std::max(image.pixelsOfLobe(), 1.0);
  const auto count = static_cast<std::size_t>(std::clamp(kMeanWork / pixels, kLeastMeanPoints, kMostMeanPoints));
  const PlanePoints points = lookAtPlane(example, count);
  background.add({}, 1);
  for (const Vec2 n : points.normals) image.add(n, 1);
  TileImage all(shape.resolution, shape.sigma_r);
  all.addImage(image, static_cast<double>(points.normals.size()));
  all.addImage(background, static_cast<double>(points.background));
  data.images.levels.push_back(joinImages({storeImage(all, shape, data.images.precision, data.images.value_scale)}));
  const SlopeSums sums = slopeSums(points.normals.data(), points.normals.size());
  data.images.shape.slopes = sums.moments(static_cast<double>(count));
  data.covered = static_cast<float>(static_cast<double>(points.normals.size()) / static_cast<double>(count));
}

}  // namespace

TinyExample TinyExampleData::view() const {
  TinyExample v = shape;
  v.images = images.view();
  v.normals = normals;
  return v;
}

std::size_t TinyExampleData::sizeBytes() const {
  std::size_t bytes = normals.size() * sizeof(Vec2);
  for (const NdfPyramidData::Level& level : images.levels)
    bytes += level.masks.size() * sizeof(std::uint64_t) + level.mask_ranks.size() * sizeof(std::uint32_t) +
             level.block_means.size() * sizeof(float) + level.half_pixels.size() * sizeof(std::uint16_t) +
             level.float_pixels.size() * sizeof(float);
  return bytes;
}

TinyExampleData buildTinyExample(const NormalMap& example, const TinyOptions& options, const ProgressFn& progress) {
  checkOptions(options);
  checkExample(example);
  TinyExampleData data;
  TinyExample& shape = data.shape;
  shape.mode = options.mode;
  data.normals.assign(example.normals.begin(), example.normals.end());
  if (options.mode == TinyMode::tiled) {
    const NormalTurn turn(options.matrix, options.heights);
    for (Vec2& n : data.normals) n = insideDisk(turn.turned(n));
    const Matrix2& m = options.matrix;
    shape.matrix[0] = m.xx, shape.matrix[1] = m.xy, shape.matrix[2] = m.yx, shape.matrix[3] = m.yy;
    shape.offset = options.offset;
  } else {
    shape.transforms = options.transforms;
    shape.density = options.density;
    shape.overlap = options.overlap;
    shape.seed = options.seed;
  }
  shape.background_sigma_r = options.background_sigma_r > 0 ? options.background_sigma_r : options.sigma_r;
  data.images.shape = imagesShape(options, example.width);
  data.images.precision = options.precision;
  // As in a pyramid: a pixel mean can reach (resolution / 2)^2, and the largest half is 65504.
  data.images.value_scale =
      options.resolution > 256 ? static_cast<float>(options.resolution * options.resolution) / (256 * 256) : 1;
  NormalMap turned = example;
  turned.normals = data.normals;
  data.images.shape.slopes = slopesOf(turned);

  std::size_t images = 0;
  for (int l = 0; l < data.images.shape.level_count; ++l) images += data.images.shape.levels[l].imageCount();
  ProgressCounter counter(progress, images);
  std::vector<NdfPyramidData::Level> levels;
  const TinyExample parameters = data.view();
  buildLevels(parameters, data, counter, levels);
  data.images.levels = std::move(levels);
  if (options.mode == TinyMode::scattered) {
    addPlaneMean(parameters, data);
    counter.advance();
  }
  return data;
}

}  // namespace glint::bake
