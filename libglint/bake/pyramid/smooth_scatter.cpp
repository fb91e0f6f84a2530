#include "glint/bake/pyramid/smooth_scatter.h"

#include <tbb/enumerable_thread_specific.h>
#include <tbb/parallel_for.h>
#include <tbb/parallel_pipeline.h>
#include <tbb/task_arena.h>

#include <algorithm>
#include <bit>
#include <cmath>
#include <deque>
#include <memory>
#include <mutex>
#include <vector>

#include "glint/bake/pyramid/flat_scatter.h"
#include "glint/bake/pyramid/triangle_splat.h"
#include "glint/query/detail/common/footprint_weights.h"

namespace glint::bake {
namespace {

constexpr int kCellsPerStride = 8;

using CellRow = std::vector<BlockBins>;  // [cells]: moments of a row of the lattice
using RowSums = std::vector<BlockBins>;  // [columns of images]: a row of cells, summed with the weights of the images along x

/// Rows of empty bins. Bins that are given back keep their memory for their next use.
class SpareRows {
 public:
  SpareRows(int size, std::size_t tiles, int channels) : size_(size), tiles_(tiles), channels_(channels) {}

  std::vector<BlockBins> take() {
    const std::scoped_lock lock(mutex_);
    if (rows_.empty()) return std::vector<BlockBins>(size_, BlockBins(tiles_, channels_));
    std::vector<BlockBins> row = std::move(rows_.back());
    rows_.pop_back();
    return row;
  }
  void give(std::vector<BlockBins>& row) {
    for (BlockBins& bins : row) bins.clear();
    const std::scoped_lock lock(mutex_);
    rows_.push_back(std::move(row));
    row.clear();
  }

 private:
  int size_;
  std::size_t tiles_;
  int channels_;
  std::mutex mutex_;
  std::vector<std::vector<BlockBins>> rows_;
};

/// The lattice of one level along one axis.
struct Axis {
  float size;     // texels of the map
  float spacing;  // texels of a cell
  int cells;
  bool wrap;

  /// Whether the lattice of the next level has half the cells. Along the short side of a narrow map, a single cell stays one.
  bool halves() const { return cells > 1; }
  Axis coarser() const { return halves() ? Axis{size, 2 * spacing, cells / 2, wrap} : *this; }
  /// The cell of the next level that has this cell as a part, and the position of the part.
  int parent(int cell) const { return halves() ? cell / 2 : cell; }
  CellPart partOf(int cell) const { return halves() ? CellPart::half(cell % 2 != 0) : CellPart::whole(); }
  /// Whether this cell is the last part of its parent.
  bool endsParent(int cell) const { return !halves() || cell % 2 != 0; }

  /// Cells that a footprint may reach, in ascending order.
  std::vector<int> cellsWithin(float centre, float reach) const {
    const int first = static_cast<int>(std::floor((centre - reach) / spacing)) - 1;
    const int last = static_cast<int>(std::floor((centre + reach) / spacing)) + 1;
    std::vector<int> found;
    if (last - first + 1 >= cells)
      for (int c = 0; c < cells; ++c) found.push_back(c);
    else
      for (int c = first; c <= last; ++c)
        if (wrap || (c >= 0 && c < cells)) found.push_back(wrapIndex(c, cells));
    std::sort(found.begin(), found.end());
    return found;
  }

  /// Approximates the weight of a Gaussian footprint over a cell by the best linear function, summed over the periods of the
  /// map.
  LinearWeight weight(int cell, float centre, float sigma) const {
    const float reach = kPyramidReach * sigma;
    float d = (static_cast<float>(cell) + 0.5f) * spacing - centre;
    LinearWeight sum = {0, 0};
    if (wrap) d -= size * std::floor((d + reach) / size);  // the first period at or right of -reach
    for (; std::fabs(d) <= reach; d += size) {
      for (int k = 0; k < 4; ++k) {  // Gauss-Legendre quadrature on [-1/2, 1/2]
        constexpr float kPlaces[4] = {-0.43056816f, -0.16999052f, 0.16999052f, 0.43056816f};
        constexpr float kShares[4] = {0.17392742f, 0.32607258f, 0.32607258f, 0.17392742f};
        const float x = (d + kPlaces[k] * spacing) / sigma;
        const float w = kShares[k] * std::exp(-0.5f * x * x);
        sum.mean += w;
        sum.slope += 12 * kPlaces[k] * w;
      }
      if (!wrap) break;
    }
    return sum;
  }
};

Axis finestAxis(int size, float stride, int levels, bool wrap) {
  const int wanted = static_cast<int>(std::ceil(static_cast<float>(size) * kCellsPerStride / stride));
  // Every level halves the lattice until one cell is left, so the number of cells is a multiple of a power of two. Cells are a
  // little smaller than an eighth of a stride for it.
  const int multiple = std::min(1 << (levels - 1), static_cast<int>(std::bit_ceil(static_cast<unsigned>(wanted))));
  const int cells = (wanted + multiple - 1) / multiple * multiple;
  return {static_cast<float>(size), static_cast<float>(size) / static_cast<float>(cells), cells, wrap};
}

/// Weights of the cells of a lattice in the images of one level, along one axis.
class AxisWeights {
 public:
  struct Entry {
    int index;
    LinearWeight weight;
  };

  /// Weights of Gaussian footprints.
  /// @param wanted   images that get weights; the others have none
  /// @param spacing  distance between neighbouring centres, texels
  AxisWeights(const Axis& axis, int images, ImageRows wanted, float spacing, float sigma)
      : images_of_(axis.cells), cells_of_(images) {
    for (int i = wanted.first; i < wanted.end; ++i) {
      const float centre = (static_cast<float>(i) + 0.5f) * spacing;
      for (const int c : axis.cellsWithin(centre, kPyramidReach * sigma)) add(i, c, axis.weight(c, centre, sigma));
    }
  }

  /// Equal weights of all cells, for a single image.
  /// @param wanted  whether the image gets weights
  static AxisWeights even(const Axis& axis, bool wanted) {
    AxisWeights weights(axis);
    for (int c = 0; c < axis.cells && wanted; ++c) weights.add(0, c, {1, 0});
    return weights;
  }

  const std::vector<Entry>& imagesOf(int cell) const { return images_of_[cell]; }
  const std::vector<Entry>& cellsOf(int image) const { return cells_of_[image]; }

 private:
  explicit AxisWeights(const Axis& axis) : images_of_(axis.cells), cells_of_(1) {}

  void add(int image, int cell, LinearWeight weight) {
    if (weight.mean <= 0) return;
    images_of_[cell].push_back({image, weight});
    cells_of_[image].push_back({cell, weight});
  }

  std::vector<std::vector<Entry>> images_of_, cells_of_;
};

/// The images of a level that are wanted, along either axis.
struct Wanted {
  ImageRows columns, rows;
};

/// The images of one level. An image is in memory from its first row of cells to its last.
class Level {
 public:
  Level(const PyramidShape& shape, int level, const Wanted& wanted, const Axis& x, const Axis& y, std::size_t tiles,
        const ImageSink& sink)
      : level_(level),
        columns_(shape.levels[level].columns),
        wanted_columns_(wanted.columns),
        axis_x_(x),
        axis_y_(y),
        x_(weightsOf(shape, level, x, columns_, wanted.columns, shape.spacing(level).x)),
        y_(weightsOf(shape, level, y, shape.levels[level].rows, wanted.rows, shape.spacing(level).y)),
        sink_(sink),
        image_rows_(shape.levels[level].rows),
        spare_images_(columns_, tiles, 1),
        spare_sums_(columns_, tiles, 2) {}

  const Axis& axisX() const { return axis_x_; }
  const Axis& axisY() const { return axis_y_; }

  /// Whether a wanted image has a weight in a column or row of cells.
  bool usesColumn(int c) const { return !x_.imagesOf(c).empty(); }
  bool usesRow(int r) const { return !y_.imagesOf(r).empty(); }

  RowSums takeSums() { return spare_sums_.take(); }
  void giveSums(RowSums& sums) {
    if (!sums.empty()) spare_sums_.give(sums);
  }

  /// Adds cell c of a row to the sums of every image that the cell has a weight in.
  void addCell(int c, const BlockBins& cell, RowSums& sums) const {
    for (const auto& [i, weight] : x_.imagesOf(c)) addAlongX(cell, weight, sums[i]);
  }

  /// Sums a whole row of cells for every column of images.
  RowSums sumsOf(const CellRow& row) {
    RowSums sums = takeSums();
    tbb::parallel_for(wanted_columns_.first, wanted_columns_.end, [&](int i) {
      for (const auto& [c, weight] : x_.cellsOf(i)) addAlongX(row[c], weight, sums[i]);
    });
    return sums;
  }

  /// Adds row r of cells to its images, and gives the images that end with this row to the sink. Call in the order of rows.
  void addRow(int r, const RowSums& sums) {
    for (const auto& [j, weight] : y_.imagesOf(r)) {
      std::vector<BlockBins>& images = image_rows_[j];
      if (images.empty()) images = spare_images_.take();
      const bool complete = y_.cellsOf(j).back().index == r;
      tbb::parallel_for(wanted_columns_.first, wanted_columns_.end, [&, j = j, weight = weight](int i) {
        addAlongY(sums[i], weight, images[i]);
        if (complete) sink_(level_, i, j, images[i]);
      });
      if (complete) spare_images_.give(images);
    }
  }

 private:
  static AxisWeights weightsOf(const PyramidShape& shape, int level, const Axis& axis, int images, ImageRows wanted,
                               float spacing) {
    const float sigma = kFootprintPerStride * shape.levels[level].stride;
    return level < shape.footprintLevels() ? AxisWeights(axis, images, wanted, spacing, sigma)
                                           : AxisWeights::even(axis, wanted.count() > 0);
  }

  int level_;
  int columns_;
  ImageRows wanted_columns_;
  Axis axis_x_, axis_y_;
  AxisWeights x_, y_;
  const ImageSink& sink_;
  std::vector<std::vector<BlockBins>> image_rows_;
  SpareRows spare_images_, spare_sums_;
};

/// Rasterises the triangles of the map into cells of the lattice.
class Rasteriser {
 public:
  Rasteriser(const NormalMap& map, const Axis& x, const Axis& y, const DirectionTiles& tiles, float sigma_bins)
      : map_(map), x_(x), y_(y), splatters_([=] { return TriangleSplatter(tiles, sigma_bins); }) {}

  /// Adds the moments of the surface in cell (a, b) of the lattice to `cell`.
  void addCell(int a, int b, BlockBins& cell) {
    TriangleSplatter& splatter = splatters_.local();
    const auto [j0, j1] = texelsIn(y_, b, map_.height);
    const auto [i0, i1] = texelsIn(x_, a, map_.width);
    for (int j = j0; j < j1; ++j)
      for (int i = i0; i < i1; ++i) addSquare(i, j, a, b, splatter);
    splatter.moveTo(cell);
  }

 private:
  /// Squares of four texel centres, along one axis, whose middle (i + 1 for square i) lies in cell `a` of the lattice: [first,
  /// end). A map that does not wrap has no square after its last texel.
  static std::pair<int, int> texelsIn(const Axis& axis, int a, int size) {
    const auto first = [&](int cell) {
      return cell >= axis.cells ? size : static_cast<int>(std::ceil(static_cast<float>(cell) * axis.spacing)) - 1;
    };
    if (!axis.wrap) return {std::max(0, first(a)), std::min(size - 1, a + 1 >= axis.cells ? size - 1 : first(a + 1))};
    return {first(a), a + 1 >= axis.cells ? size - 1 : first(a + 1)};
  }

  void addSquare(int i, int j, int a, int b, TriangleSplatter& splatter) const {
    const int left = i < 0 ? i + map_.width : i, bottom = j < 0 ? j + map_.height : j;
    const int right = left + 1 < map_.width ? left + 1 : 0, top = bottom + 1 < map_.height ? bottom + 1 : 0;
    const Vec2 n00 = map_.at(left, bottom), n10 = map_.at(right, bottom), n01 = map_.at(left, top), n11 = map_.at(right, top);
    for (int half = 0; half < 2; ++half) {
      // The centroid of a triangle lies a sixth of a texel off the middle of the square.
      const float sixth = 1.0f / 6, sign = half == 0 ? 1.0f : -1.0f;
      const float x = (static_cast<float>(i + 1) + sign * sixth) / x_.spacing - static_cast<float>(a) - 0.5f;
      const float y = (static_cast<float>(j + 1) - sign * sixth) / y_.spacing - static_cast<float>(b) - 0.5f;
      const float weights[kMoments] = {1, x, y, x * y};
      splatter.add(n00, half == 0 ? n10 : n01, n11, weights);
    }
  }

  const NormalMap& map_;
  Axis x_, y_;
  tbb::enumerable_thread_specific<TriangleSplatter> splatters_;
};

/// Adds the cells of a row to the row of cells of the next level.
void addParts(const CellRow& row, const Axis& x, CellPart y, CellRow& coarser) {
  const int parts = x.halves() ? 2 : 1;
  tbb::parallel_for(0, static_cast<int>(coarser.size()), [&](int c) {
    for (int cell = parts * c; cell < parts * (c + 1); ++cell) addPart(row[cell], x.partOf(cell), y, coarser[c]);
  });
}

/// Cells of the lattice of each level that images need, along one axis: of their own level, or as parts of cells of coarser levels.
/// @param axisOf   axisOf(level)
/// @param usesCell  usesCell(level, cell): whether images of the level have a weight there
/// @return [levels][cells]
template <class AxisOf, class UsesCell>
std::vector<std::vector<bool>> neededCells(const std::deque<Level>& levels, const AxisOf& axisOf, const UsesCell& usesCell) {
  std::vector<std::vector<bool>> needed(levels.size());
  for (std::size_t l = levels.size(); l-- > 0;) {
    const Axis& axis = axisOf(levels[l]);
    for (int c = 0; c < axis.cells; ++c)
      needed[l].push_back(usesCell(levels[l], c) ||
                          (l + 1 < levels.size() && needed[l + 1][static_cast<std::size_t>(axis.parent(c))]));
  }
  return needed;
}

/// All levels but the finest. Rows of cells come in order, and every two rows make a row of the next level.
class CoarseLevels {
 public:
  /// @param needed  [levels][rows]: rows of cells that images need
  CoarseLevels(std::deque<Level>& levels, const std::vector<std::vector<bool>>& needed, std::size_t tiles)
      : levels_(levels), needed_(needed), tiles_(tiles), halves_(levels.size()) {}

  void addRow(std::size_t level, int r, const CellRow& row) {
    if (levels_[level].usesRow(r)) {
      RowSums sums = levels_[level].sumsOf(row);
      levels_[level].addRow(r, sums);
      levels_[level].giveSums(sums);
    }
    if (level + 1 == levels_.size()) return;
    if (!needed_[level + 1][static_cast<std::size_t>(levels_[level].axisY().parent(r))]) return;
    const Axis &x = levels_[level].axisX(), &y = levels_[level].axisY();
    CellRow& coarser = halves_[level];
    if (coarser.empty()) coarser.assign(x.coarser().cells, BlockBins(tiles_, kMoments));
    addParts(row, x, y.partOf(r), coarser);
    if (!y.endsParent(r)) return;
    addRow(level + 1, y.parent(r), coarser);
    for (BlockBins& cell : coarser) cell.clear();
  }

 private:
  std::deque<Level>& levels_;
  const std::vector<std::vector<bool>>& needed_;
  std::size_t tiles_;
  std::vector<CellRow> halves_;  // [levels]: row of the next level that is not complete yet
};

/// The result of one task: a row of cells of the second level, and the sums of the two rows of the finest level that are its
/// parts. With a single level there is no row of cells, and there may be one row of sums only.
struct Band {
  int index;
  RowSums sums[2];
  CellRow coarser;
};

/// Exchanges rows and columns of a map. Normals are not turned.
std::vector<Vec2> transposed(const NormalMap& map) {
  std::vector<Vec2> normals(map.normals.size());
  tbb::parallel_for(0, map.width, [&](int i) {
    for (int j = 0; j < map.height; ++j) normals[static_cast<std::size_t>(i) * map.height + j] = map.at(i, j);
  });
  return normals;
}

PyramidShape transposed(PyramidShape shape) {
  std::swap(shape.width, shape.height);
  for (PyramidGrid& grid : shape.levels) std::swap(grid.columns, grid.rows);
  return shape;
}

/// Computes all images, with whole rows of cells in memory: the caller makes rows the shorter side.
/// @param wanted  [levels]
void scatterByRows(const NormalMap& map, const PyramidShape& shape, const std::vector<Wanted>& wanted,
                   const DirectionTiles& direction_tiles, const ImageSink& sink, const ProgressFn& progress) {
  const bool wrap = shape.boundary == Boundary::wrap;
  const Axis finest_x = finestAxis(map.width, shape.levels[0].stride, shape.level_count, wrap);
  const Axis finest_y = finestAxis(map.height, shape.levels[0].stride, shape.level_count, wrap);
  const std::size_t tiles = direction_tiles.count();
  const float sigma_bins = 0.5f * shape.sigma_r * static_cast<float>(direction_tiles.fine.bins_per_axis);
  Rasteriser rasteriser(map, finest_x, finest_y, direction_tiles, sigma_bins);

  std::deque<Level> levels;  // a deque, since a level cannot be moved
  Axis x = finest_x, y = finest_y;
  for (int l = 0; l < shape.level_count; ++l, x = x.coarser(), y = y.coarser())
    levels.emplace_back(shape, l, wanted[static_cast<std::size_t>(l)], x, y, tiles, sink);
  const auto columns = neededCells(
      levels, [](const Level& level) -> const Axis& { return level.axisX(); },
      [](const Level& level, int c) { return level.usesColumn(c); });
  const auto rows = neededCells(
      levels, [](const Level& level) -> const Axis& { return level.axisY(); },
      [](const Level& level, int r) { return level.usesRow(r); });
  CoarseLevels coarse(levels, rows, tiles);
  const bool has_coarser = shape.level_count > 1;
  SpareRows spare_cells(finest_x.coarser().cells, tiles, kMoments);

  // Tasks rasterise bands in parallel.
  tbb::enumerable_thread_specific<BlockBins> scratch([=] { return BlockBins(tiles, kMoments); });
  const auto makeBand = [&](int index) {
    Band band = {index, {}, {}};
    const auto coarser_row = static_cast<std::size_t>(finest_y.parent(2 * index));
    const bool adds_parts = has_coarser && rows[1][coarser_row];
    if (adds_parts) band.coarser = spare_cells.take();
    for (int upper = 0; upper < 2 && 2 * index + upper < finest_y.cells; ++upper) {
      const int r = 2 * index + upper;
      const bool adds_sums = levels[0].usesRow(r);
      if (!adds_sums && !adds_parts) continue;
      if (adds_sums) band.sums[upper] = levels[0].takeSums();
      for (int a = 0; a < finest_x.cells; ++a) {
        if (!columns[0][static_cast<std::size_t>(a)]) continue;
        BlockBins& cell = scratch.local();
        rasteriser.addCell(a, r, cell);
        if (adds_sums) levels[0].addCell(a, cell, band.sums[upper]);
        if (adds_parts) addPart(cell, finest_x.partOf(a), finest_y.partOf(upper), band.coarser[finest_x.parent(a)]);
        cell.clear();
      }
    }
    return std::make_shared<Band>(std::move(band));
  };
  // One task after the other adds its band to the images.
  const auto addBand = [&](Band& band) {
    for (int upper = 0; upper < 2 && 2 * band.index + upper < finest_y.cells; ++upper) {
      levels[0].addRow(2 * band.index + upper, band.sums[upper]);
      levels[0].giveSums(band.sums[upper]);
    }
    if (!band.coarser.empty()) {
      coarse.addRow(1, band.index, band.coarser);
      spare_cells.give(band.coarser);
    }
    if (progress) progress(band.index + 1, (finest_y.cells + 1) / 2);
  };

  using BandPtr = std::shared_ptr<Band>;
  int next = 0;
  const auto source = [&](tbb::flow_control& control) {
    if (2 * next >= finest_y.cells) control.stop();
    return next++;
  };
  tbb::parallel_pipeline(
      static_cast<std::size_t>(tbb::this_task_arena::max_concurrency()) + 1,
      tbb::make_filter<void, int>(tbb::filter_mode::serial_in_order, source) &
          tbb::make_filter<int, BandPtr>(tbb::filter_mode::parallel, makeBand) &
          tbb::make_filter<BandPtr, void>(tbb::filter_mode::serial_in_order, [&](const BandPtr& band) { addBand(*band); }));
}

}  // namespace

void scatterSmooth(const NormalMap& map, const PyramidShape& shape, PyramidRegion region, const DirectionTiles& direction_tiles,
                   const ImageSink& sink, const ProgressFn& progress) {
  const bool turn = map.width > map.height;
  std::vector<Wanted> wanted;
  for (int l = 0; l < shape.level_count; ++l) {
    const ImageRows columns = {0, shape.levels[l].columns}, rows = regionRows(shape, l, region);
    wanted.push_back(turn ? Wanted{rows, columns} : Wanted{columns, rows});
  }
  if (!turn) return scatterByRows(map, shape, wanted, direction_tiles, sink, progress);
  // Memory grows with the length of a row, so rows must be the shorter side. The diagonal that cuts squares into triangles is
  // the same after rows and columns are exchanged.
  const std::vector<Vec2> normals = transposed(map);
  NormalMap turned;
  turned.width = map.height;
  turned.height = map.width;
  turned.normals = normals;
  const ImageSink turned_sink = [&](int level, int i, int j, const BlockBins& bins) { sink(level, j, i, bins); };
  scatterByRows(turned, transposed(shape), wanted, direction_tiles, turned_sink, progress);
}

}  // namespace glint::bake
