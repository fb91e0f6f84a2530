#include "glint/bake/wang/tile_pyramid.h"

#include <tbb/enumerable_thread_specific.h>
#include <tbb/parallel_for.h>

#include <algorithm>
#include <cstddef>

#include "glint/bake/pyramid/flat_scatter.h"
#include "glint/bake/pyramid/image_bytes.h"
#include "glint/bake/pyramid/image_packer.h"
#include "glint/model/error.h"

namespace glint::bake {
namespace {

/// The centres of a level of footprints along one axis of a tile: in the middle of equal parts of the tile, so that the grids of
/// neighbouring tiles go on over their border.
struct Centres {
  int columns;
  float gap, sigma;
  int size;
  /// @param k  0 for the first centre in the tile
  float at(int k) const { return (static_cast<float>(k) + 0.5f) * gap; }
  double share(int k) const { return shareInTile(at(k), sigma, size); }
};

/// How many centres beyond the border meet a tile, and the masses of all centres.
WangGrid gridOf(const Centres& centres, std::vector<float>& masses) {
  WangGrid grid;
  grid.columns = centres.columns;
  const int most = WangGrid::kMostMargins * centres.columns;
  while (grid.margin < most && centres.share(-grid.margin - 1) >= kLeastTileShare) ++grid.margin;
  std::vector<double> shares;
  for (int k = -grid.margin; k < grid.columns + grid.margin; ++k) shares.push_back(centres.share(k));
  // A centre lies at places k, k + columns and so on of its tiles: their masses sum to 1.
  for (int k = 0; k < grid.columns; ++k) {
    double total = 0;
    for (int place = k; place < grid.side(); place += grid.columns) total += shares[static_cast<std::size_t>(place)];
    for (int place = k; place < grid.side(); place += grid.columns) shares[static_cast<std::size_t>(place)] /= total;
  }
  masses.assign(shares.begin(), shares.end());
  return grid;
}

NormalMap mapOf(const WangTiles& tiles, int first, int count) {
  NormalMap map;
  map.width = tiles.size, map.height = count * tiles.size;
  map.normals = tiles.normals.subspan(static_cast<std::size_t>(first) * tiles.texelsOfTile(),
                                      static_cast<std::size_t>(count) * tiles.texelsOfTile());
  return map;
}

/// Bins of one thread.
struct Scratch {
  Scratch(int resolution, const PixelFilter& filter)
      : bins(resolution, filter.subdivision(), filter.margin()), band(resolution, filter.subdivision(), filter.margin()) {}
  DirectionBins bins, band;
};

/// Makes the images of one level of footprints, or with no grid the mean of all tiles.
class LevelMaker {
 public:
  LevelMaker(const WangTiles& tiles, const PyramidShape& shape, const PixelFilter& filter, const ImagePacker& packer)
      : tiles_(tiles), shape_(shape), filter_(filter), packer_(packer), scratch_([&shape, &filter] {
          return Scratch(shape.resolution, filter);
        }) {}

  /// Makes the image k of a level.
  PackedImage makeOne(const WangGrid& grid, const Centres& centres, std::size_t k) {
    const auto side = static_cast<std::size_t>(grid.side());
    const auto column = static_cast<int>(k % side), row = static_cast<int>(k / side % side);
    const NormalMap tile = mapOf(tiles_, static_cast<int>(k / (side * side)), 1);
    return image([&](Scratch& s) {
      scatterFlatTile(tile, {centres.at(column - grid.margin), centres.at(row - grid.margin)}, centres.sigma, s.bins, s.band);
    });
  }
  std::vector<PackedImage> make(const WangGrid& grid, const Centres& centres, ProgressCounter& counter) {
    const auto side = static_cast<std::size_t>(grid.side());
    std::vector<PackedImage> images(static_cast<std::size_t>(tiles_.tile_count) * side * side);
    tbb::parallel_for(std::size_t{0}, images.size(), [&](std::size_t k) {
      images[k] = makeOne(grid, centres, k);
      counter.advance();
    });
    return images;
  }
  std::vector<PackedImage> makeMean(ProgressCounter& counter) {
    const NormalMap all = mapOf(tiles_, 0, tiles_.tile_count);
    std::vector<PackedImage> images;
    images.push_back(image([&](Scratch& s) { scatterFlatMap(all, s.bins, s.band); }));
    counter.advance();
    return images;
  }

 private:
  template <class Scatter>
  PackedImage image(const Scatter& scatter) {
    Scratch& s = scratch_.local();
    scatter(s);
    const Layer layer = {&s.bins, &filter_};
    PackedImage packed = packer_.pack({&layer, 1}, 1);
    s.bins.clear();
    return packed;
  }

  const WangTiles& tiles_;
  const PyramidShape& shape_;
  const PixelFilter& filter_;
  const ImagePacker& packer_;
  tbb::enumerable_thread_specific<Scratch> scratch_;
};

/// Where the images of all levels are.
struct Layout {
  WangImagesData plane;
  PyramidShape shape;
  std::vector<Centres> centres;  ///< of each level of footprints

  std::size_t imageCount() const {
    std::size_t count = 0;
    for (int l = 0; l < shape.level_count; ++l) count += shape.levels[l].imageCount();
    return count;
  }
};

Layout layoutOf(const WangTiles& tiles, const PyramidOptions& options) {
  checkPyramidOptions(options);
  if (options.surface == Surface::smooth)
    throw Error(ErrorCode::unsupported, "option.value", {}, "--surface", "smooth surfaces of Wang tiles have no pyramid",
                "give --surface flat, or ask the tiles themselves with glint-query plane");
  PyramidOptions tile_options = options;
  tile_options.boundary = Boundary::clamp;
  Layout layout;
  WangImagesData& plane = layout.plane;
  plane.tiles = tiles;
  plane.tiles.normals = {};
  PyramidShape& shape = layout.shape;
  shape = pyramidShape(tiles.size, tiles.size, tile_options);
  shape.slopes = tiles.slopes;
  plane.level_count = shape.footprintLevels();
  for (int l = 0; l < shape.footprintLevels(); ++l) {
    const int columns = shape.levels[l].columns;
    layout.centres.push_back({columns, static_cast<float>(tiles.size) / static_cast<float>(columns),
                              kFootprintPerStride * shape.levels[l].stride, tiles.size});
    const auto at = static_cast<std::size_t>(l);
    plane.grids[at] = gridOf(layout.centres.back(), plane.masses[at]);
    shape.levels[l].columns = plane.grids[at].side();
    shape.levels[l].rows = tiles.tile_count * shape.levels[l].columns;
  }
  const auto last = static_cast<std::size_t>(shape.footprintLevels());
  plane.grids[last].columns = 1;
  plane.masses[last] = {1};
  return layout;
}

}  // namespace

WangImages WangImagesData::view() const {
  WangImages v;
  v.tiles = tiles;
  for (std::size_t l = 0; l < grids.size(); ++l) v.grids[l] = grids[l], v.grids[l].masses = masses[l];
  return v;
}

double wangPyramidBytes(const WangTiles& tiles, const PyramidOptions& options, double most_bytes) {
  const Layout layout = layoutOf(tiles, options);
  const PixelFilter filter = flatFilter(options);
  const ImagePacker packer(layout.shape, BlockPrecision::f16, 1);
  LevelMaker maker(tiles, layout.shape, filter, packer);
  return imageBytes(layout.shape, options.precision, most_bytes, [&](int level, std::size_t image) {
    const auto at = static_cast<std::size_t>(level);
    return maker.makeOne(layout.plane.grids[at], layout.centres[at], image).means.size();
  });
}

WangPyramidData buildWangPyramid(const WangTiles& tiles, const PyramidOptions& options, const ProgressFn& progress) {
  const Layout layout = layoutOf(tiles, options);
  WangPyramidData data;
  data.plane = layout.plane;
  data.images.shape = layout.shape;
  data.images.precision = options.precision;
  data.images.value_scale = valueScaleFor(options.resolution);

  const PixelFilter filter = flatFilter(options);
  const ImagePacker packer(layout.shape, options.precision, data.images.value_scale);
  LevelMaker maker(tiles, layout.shape, filter, packer);
  ProgressCounter counter(progress, layout.imageCount());
  for (int l = 0; l < layout.shape.level_count; ++l) {
    const auto at = static_cast<std::size_t>(l);
    std::vector<PackedImage> images = l < layout.shape.footprintLevels()
                                          ? maker.make(layout.plane.grids[at], layout.centres[at], counter)
                                          : maker.makeMean(counter);
    data.images.levels.push_back(packLevel(images, options.precision));
  }
  return data;
}

std::vector<float> imageMasses(const WangPyramid& pyramid) {
  std::vector<float> masses;
  for (int l = 0; l < pyramid.images.shape.level_count; ++l) {
    const PyramidGrid& images = pyramid.images.shape.levels[l];
    const WangGrid& grid = pyramid.plane.grids[l];
    for (int j = 0; j < images.rows; ++j)
      for (int i = 0; i < images.columns; ++i)
        masses.push_back(grid.masses[static_cast<std::size_t>(i)] * grid.masses[static_cast<std::size_t>(j % grid.side())]);
  }
  return masses;
}

}  // namespace glint::bake
