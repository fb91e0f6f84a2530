#include "glint/bake/wang/wang_tiles.h"

#include <tbb/parallel_for.h>

#include <algorithm>
#include <array>
#include <cmath>
#include <cstdlib>
#include <optional>
#include <string>
#include <utility>

#include "glint/bake/common/counter_random.h"
#include "glint/bake/wang/normal_cells.h"
#include "glint/bake/wang/patches.h"
#include "glint/bake/wang/repetition.h"
#include "glint/bake/wang/seam_cut.h"
#include "glint/bake/wang/tile_border.h"
#include "glint/model/error.h"
#include "glint/model/slope_sums.h"
#include "glint/query/wang_layout.h"

namespace glint::bake {
namespace {

constexpr int kLeastMap = 16;  // texels along an axis of a map that blocks can be cut from
constexpr int kBorderCandidates = 32;
constexpr int kInteriorCandidates = 96;
constexpr int kShortlist = 6;  // of the interiors that fit best; the normals of the set choose among them

int overlapOf(const WangOptions& options) {
  constexpr int kDefaultShare = 16, kLeast = 4;
  return options.overlap > 0 ? options.overlap : std::max(kLeast, options.size / kDefaultShare);
}

[[noreturn]] void refuse(const std::string& object, const std::string& what, const std::string& remedy) {
  throw Error(ErrorCode::usage, "option.range", {}, object, what, remedy);
}

void checkOptions(const WangOptions& o) {
  const auto within = [](int x, int low, int high) { return x >= low && x <= high; };
  if (!within(o.size, WangTiles::kLeastSize, WangTiles::kMostSize))
    refuse("--size", std::to_string(o.size) + " is out of range", "give 16 to 4096 texels");
  for (const int colors : {o.colors_h, o.colors_v})
    if (!within(colors, WangTiles::kLeastColors, WangTiles::kMostColors))
      refuse("--colors", std::to_string(colors) + " is out of range", "give 2 to 8: one colour makes a plane that repeats");
  if (o.scheme == WangScheme::corner && o.colors_h != o.colors_v)
    refuse("--colors", "two numbers do not fit --scheme corner", "give one number of colours, or --scheme edge");
  const int combinations = o.colors_h * o.colors_h * o.colors_v * o.colors_v;
  if (o.tile_count % combinations != 0 || !within(o.tile_count, combinations, WangTiles::kMostTiles))
    refuse("--tiles", std::to_string(o.tile_count) + " tiles do not fit the colours",
           "give " + std::to_string(combinations) + ", one for each combination of colours, or a multiple of it up to 4096");
  if (std::int64_t{o.tile_count} * o.size * o.size > WangTiles::kMostTexels)
    refuse("--size", "the tiles together have more than 2^30 texels", "give fewer or smaller tiles");
  if (o.overlap != 0 && !within(o.overlap, 2, o.size / 4))
    refuse("--overlap", std::to_string(o.overlap) + " is out of range", "give 2 texels to a quarter of --size");
}

WangTiles shapeOf(const NormalMap& map, const WangOptions& options) {
  WangTiles shape;
  shape.size = options.size;
  shape.scheme = options.scheme;
  shape.colors_h = options.colors_h, shape.colors_v = options.colors_v;
  shape.tile_count = options.tile_count;
  shape.plane_seed = static_cast<int>(randomBits(options.seed, static_cast<std::uint64_t>(WangStream::plane), 0) & 0x3fffffff);
  shape.texel_size_um = map.texel_size_um;
  return shape;
}

NormalCells cellsOf(std::span<const Vec2> normals) {
  NormalCells cells;
  for (const Vec2 n : normals) cells.add(n);
  return cells;
}

/// Square root of the mean of |n - mean|^2: what differences between unrelated texels are like.
double spreadOf(std::span<const Vec2> normals) {
  double x = 0, y = 0, square = 0;
  for (const Vec2 n : normals) x += double{n.x}, y += double{n.y}, square += double{dot(n, n)};
  const auto count = static_cast<double>(normals.size());
  return std::sqrt(std::max(0.0, square / count - (x * x + y * y) / (count * count)));
}

/// Mean difference between neighbouring texels of a map.
double neighbourDifference(const NormalMap& map) {
  double sum = 0;
  std::size_t pairs = 0;
  const auto add = [&](Vec2 a, Vec2 b) { sum += double{std::sqrt(dot(a - b, a - b))}, ++pairs; };
  for (int j = 0; j < map.height; ++j)
    for (int i = 0; i < map.width; ++i) {
      if (i + 1 < map.width) add(map.at(i, j), map.at(i + 1, j));
      if (j + 1 < map.height) add(map.at(i, j), map.at(i, j + 1));
    }
  return pairs > 0 ? sum / static_cast<double>(pairs) : 0;
}

/// Finds the patches of a set of tiles, and composes them.
class TileMaker {
 public:
  TileMaker(const PatchSource& source, const NormalCells& input, double spread, const WangTiles& shape,
            const WangOptions& options)
      : source_(source),
        input_(input),
        spread_(spread),
        shape_(shape),
        overlap_(overlapOf(options)),
        seed_(options.seed),
        borders_(shape, overlap_, borderPatches()) {}

  /// @param normals  [tile_count][size][size]
  SeamSum make(std::vector<Vec2>& normals, ProgressCounter& progress);

 private:
  std::vector<Patch> borderPatches() const;
  NormalCells usedCells(const Patch& patch) const;
  std::array<int, 2> interiorGrid() const;
  PatchPlace interiorCandidate(int tile, int candidate, const std::array<int, 2>& grid) const;
  double ringMisfit(const Patch& border, PatchPlace place) const;
  NormalCells insideCells(PatchPlace place) const;
  PatchPlace chooseInterior(int tile, const Patch& border, const std::array<int, 2>& grid, NormalCells& chosen) const;
  void fillInside(PatchPlace place, Patch& tile, SeamSum& seams) const;

  const PatchSource& source_;
  const NormalCells& input_;
  double spread_;
  WangTiles shape_;
  int overlap_;
  std::uint64_t seed_;
  TileBorders borders_;
};

/// Chooses the patches one after the other: each of some random ones that fits the patches before, and brings their normals near to
/// those of the input.
std::vector<Patch> TileMaker::borderPatches() const {
  std::vector<Patch> patches;
  NormalCells chosen;
  for (int k = 0; k < TileBorders::patchCount(shape_); ++k) {
    const auto [width, height] = TileBorders::patchSize(shape_, overlap_, k);
    Patch best;
    NormalCells best_cells;
    double least = 0;
    for (int candidate = 0; candidate < kBorderCandidates; ++candidate) {
      const auto index = static_cast<std::uint64_t>(k * kBorderCandidates + candidate);
      Patch patch = source_.cut(randomPlace(source_, width, height, seed_, WangStream::borders, index), width, height);
      const NormalCells cells = usedCells(patch);
      patches.push_back(std::move(patch));
      const double misfit = TileBorders::misfit(shape_, overlap_, patches);
      const double score = chosen.totalVariation(input_, &cells) + (spread_ > 0 ? misfit / spread_ : 0);
      if (candidate == 0 || score < least) best = std::move(patches.back()), best_cells = cells, least = score;
      patches.pop_back();
    }
    patches.push_back(std::move(best));
    chosen.add(best_cells);
  }
  return patches;
}

/// The normals of a patch of a border that tiles show: of a corner's patch the arms of the cross around the vertex.
NormalCells TileMaker::usedCells(const Patch& patch) const {
  if (shape_.scheme == WangScheme::edge) return cellsOf(patch.normals);
  NormalCells cells;
  const int middle = patch.width / 2;
  for (int y = 0; y < patch.height; ++y)
    for (int x = 0; x < patch.width; ++x)
      if (std::min(std::abs(2 * x + 1 - 2 * middle), std::abs(2 * y + 1 - 2 * middle)) < overlap_) cells.add(patch.at(x, y));
  return cells;
}

/// Columns and rows of a grid over the map, a cell for each tile, so that the insides of the tiles cover the map evenly.
std::array<int, 2> TileMaker::interiorGrid() const {
  const double aspect = static_cast<double>(source_.width()) / source_.height();
  const int columns = std::clamp(static_cast<int>(std::lround(std::sqrt(shape_.tile_count * aspect))), 1, shape_.tile_count);
  return {columns, (shape_.tile_count + columns - 1) / columns};
}

/// A place near the middle of the tile's cell of the grid.
PatchPlace TileMaker::interiorCandidate(int tile, int candidate, const std::array<int, 2>& grid) const {
  const auto index = static_cast<std::uint64_t>(tile) * kInteriorCandidates + static_cast<std::uint64_t>(candidate);
  const Vec2 xi = randomPair(seed_, static_cast<std::uint64_t>(WangStream::interiors), index);
  const auto along = [&](int cell, int cells, int map, float random) {
    const double width = static_cast<double>(map) / cells;
    const double reach = std::max(0.25 * shape_.size, width - shape_.size);
    const double middle = (cell + 0.5) * width - 0.5 * shape_.size;
    return static_cast<int>(std::lround(middle + reach * (double{random} - 0.5)));
  };
  return source_.allowed(along(tile % grid[0], grid[0], source_.width(), xi.x),
                         along(tile / grid[0], grid[1], source_.height(), xi.y), shape_.size, shape_.size);
}

/// Mean difference between the border and an inside, in the middle of the ring where the seam runs.
double TileMaker::ringMisfit(const Patch& border, PatchPlace place) const {
  const int size = shape_.size, first = overlap_ / 4, last = std::max(first + 1, overlap_ * 3 / 4);
  const int depth_step = std::max(1, (last - first) / 4), step = std::max(1, size / 64);
  double sum = 0;
  std::size_t count = 0;
  const auto add = [&](int x, int y) {
    const Vec2 d = border.at(x, y) - source_.at(place.x + x, place.y + y);
    sum += double{std::sqrt(dot(d, d))}, ++count;
  };
  for (int depth = first; depth < last; depth += depth_step)
    for (int k = depth; k < size - depth; k += step) {
      add(k, depth), add(k, size - 1 - depth);
      add(depth, k), add(size - 1 - depth, k);
    }
  return sum / static_cast<double>(count);
}

NormalCells TileMaker::insideCells(PatchPlace place) const {
  NormalCells cells;
  const int first = overlap_ / 2;
  for (int y = first; y < shape_.size - first; ++y)
    for (int x = first; x < shape_.size - first; ++x) cells.add(source_.at(place.x + x, place.y + y));
  return cells;
}

PatchPlace TileMaker::chooseInterior(int tile, const Patch& border, const std::array<int, 2>& grid, NormalCells& chosen) const {
  std::vector<std::pair<double, int>> fits;
  for (int k = 0; k < kInteriorCandidates; ++k) fits.emplace_back(ringMisfit(border, interiorCandidate(tile, k, grid)), k);
  std::partial_sort(fits.begin(), fits.begin() + kShortlist, fits.end());
  PatchPlace best;
  NormalCells best_cells;
  double least = 0;
  for (int k = 0; k < kShortlist; ++k) {
    const PatchPlace place = interiorCandidate(tile, fits[static_cast<std::size_t>(k)].second, grid);
    const NormalCells cells = insideCells(place);
    const double score = chosen.totalVariation(input_, &cells);
    if (k == 0 || score < least) best = place, best_cells = cells, least = score;
  }
  chosen.add(best_cells);
  return best;
}

/// Cuts a patch into a tile whose border is there: the outermost texels stay, those deeper than the overlap are the patch's.
void TileMaker::fillInside(PatchPlace place, Patch& tile, SeamSum& seams) const {
  const int size = shape_.size;
  const Patch inside = source_.cut(place, size, size);
  std::vector<SeamSide> given(inside.normals.size());
  for (int y = 0; y < size; ++y)
    for (int x = 0; x < size; ++x) {
      const int depth = std::min({x, y, size - 1 - x, size - 1 - y});
      const bool ends = depth == overlap_ - 1;
      given[rowMajorIndex(x, y, size)] = depth == 0          ? SeamSide::first
                                         : depth >= overlap_ ? SeamSide::none
                                         : ends              ? SeamSide::second
                                                             : SeamSide::free;
    }
  const SeamProblem problem = {size, size, tile.normals, inside.normals, given};
  const std::vector<SeamSide> sides = cutSeam(problem);
  addSeams(problem, sides, seams);
  for (std::size_t k = 0; k < sides.size(); ++k)
    if (sides[k] != SeamSide::first) tile.normals[k] = inside.normals[k];
}

SeamSum TileMaker::make(std::vector<Vec2>& normals, ProgressCounter& progress) {
  const auto grid = interiorGrid();
  NormalCells chosen;
  SeamSum total;
  // Borders and cuts of some tiles at a time run at once; places are chosen one after the other, since each sees those before.
  constexpr int kBatch = 16;
  for (int begin = 0; begin < shape_.tile_count; begin += kBatch) {
    const int end = std::min(begin + kBatch, shape_.tile_count);
    std::array<Patch, kBatch> tiles;
    std::array<SeamSum, kBatch> seams;
    std::array<PatchPlace, kBatch> places;
    const auto slot = [&](int tile) { return static_cast<std::size_t>(tile - begin); };
    tbb::parallel_for(begin, end, [&](int tile) {
      tiles[slot(tile)] = {shape_.size, shape_.size, std::vector<Vec2>(shape_.texelsOfTile())};
      borders_.compose(shape_.colorsOfTile(tile), tiles[slot(tile)], seams[slot(tile)]);
    });
    for (int tile = begin; tile < end; ++tile) places[slot(tile)] = chooseInterior(tile, tiles[slot(tile)], grid, chosen);
    tbb::parallel_for(begin, end, [&](int tile) {
      fillInside(places[slot(tile)], tiles[slot(tile)], seams[slot(tile)]);
      const std::vector<Vec2>& made = tiles[slot(tile)].normals;
      std::copy(made.begin(), made.end(),
                normals.begin() + static_cast<std::ptrdiff_t>(static_cast<std::size_t>(tile) * shape_.texelsOfTile()));
      progress.advance();
    });
    for (int tile = begin; tile < end; ++tile) total.add(seams[slot(tile)]);
  }
  return total;
}

PatchSource sourceOf(const NormalMap& map, Boundary boundary) { return {map.width, map.height, map.normals, boundary}; }

/// A larger map that is quilted from the map; nothing where patches fit into the map.
std::optional<Patch> enlarged(const PatchSource& source, const WangTiles& shape, int overlap, std::uint64_t seed) {
  int width = shape.size, height = shape.size;
  for (int k = 0; k < TileBorders::patchCount(shape); ++k) {
    const auto size = TileBorders::patchSize(shape, overlap, k);
    width = std::max(width, size.width), height = std::max(height, size.height);
  }
  if (source.holds(width, height)) return std::nullopt;
  // Twice the size of a patch, so that patches of different colours differ; of the long side of a strip no more than is of use.
  const auto sizeOf = [](int patch, int map) { return std::max(2 * patch, std::min(map, 4 * patch)); };
  return quiltedMap(source, sizeOf(width, source.width()), sizeOf(height, source.height()), seed);
}

void measure(const NormalMap& map, const PatchSource& source, const NormalCells& input, const SeamSum& seams,
             WangTilesData& data) {
  const double step = neighbourDifference(map);
  WangReport& report = data.report;
  report.seam_cost = step > 0 && seams.pairs > 0 ? seams.difference / static_cast<double>(seams.pairs) / step : 0;
  report.ndf_tv = cellsOf(data.normals).totalVariation(input);
  report.repetition = std::max(0.0, planeRepetition(data.view()));
  report.input_repetition = mapRepetition(source, data.shape.size);
  data.shape.seam_cost = static_cast<float>(report.seam_cost);
  data.shape.ndf_tv = static_cast<float>(report.ndf_tv);
  data.shape.repetition = static_cast<float>(std::min(1.0, report.repetition));
  SlopeSums sums;
  const auto texels = data.shape.texelsOfTile();
  for (std::size_t first = 0; first < data.normals.size(); first += texels)
    sums.add(slopeSums(data.normals.data() + first, texels));
  data.shape.slopes = sums.moments(static_cast<double>(data.normals.size()));
}

}  // namespace

WangTiles WangTilesData::view() const {
  WangTiles tiles = shape;
  tiles.normals = normals;
  return tiles;
}

WangTilesData buildWangTiles(const NormalMap& map, const WangOptions& options, const ProgressFn& progress) {
  checkOptions(options);
  if (map.width < kLeastMap || map.height < kLeastMap) {
    throw Error(
        ErrorCode::invalid_input, "wang.map", options.name, "/normals",
        "has " + std::to_string(map.width) + " x " + std::to_string(map.height) + " texels, too few to cut patches from",
        "give a map of at least 16 x 16 texels");
  }
  WangTilesData data;
  data.shape = shapeOf(map, options);
  data.normals.resize(static_cast<std::size_t>(data.shape.tile_count) * data.shape.texelsOfTile());
  ProgressCounter counter(progress, static_cast<std::size_t>(options.tile_count));
  const PatchSource given = sourceOf(map, options.boundary);
  const std::optional<Patch> quilted = enlarged(given, data.shape, overlapOf(options), options.seed);
  const PatchSource source = quilted ? PatchSource(quilted->width, quilted->height, quilted->normals, Boundary::clamp) : given;
  const NormalCells input = cellsOf(map.normals);
  TileMaker maker(source, input, spreadOf(map.normals), data.shape, options);
  const SeamSum seams = maker.make(data.normals, counter);
  data.report.enlarged = quilted.has_value();
  measure(map, given, input, seams, data);
  return data;
}

std::vector<Vec2> explicitPlane(const WangTiles& tiles, std::int64_t x, std::int64_t y, int width, int height) {
  const WangLayout layout(tiles);
  const auto size = std::int64_t{tiles.size};
  const auto cellOf = [&](std::int64_t texel) { return texel / size - (texel % size < 0 ? 1 : 0); };
  std::vector<Vec2> normals(rowMajorIndex(0, height, width));
  tbb::parallel_for(0, height, [&](int j) {
    const std::int64_t row = y + j, cell_y = cellOf(row);
    for (int i = 0; i < width;) {
      const std::int64_t column = x + i, cell_x = cellOf(column);
      const int tile = layout.tileAt(cell_x, cell_y), begin = static_cast<int>(column - cell_x * size);
      const int count = std::min(width - i, tiles.size - begin);
      const Vec2* from = &tiles.at(tile, begin, static_cast<int>(row - cell_y * size));
      std::copy(from, from + count, normals.begin() + static_cast<std::ptrdiff_t>(rowMajorIndex(i, j, width)));
      i += count;
    }
  });
  return normals;
}

}  // namespace glint::bake
