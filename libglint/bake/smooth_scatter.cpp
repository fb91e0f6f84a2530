#include "glint/bake/smooth_scatter.h"

#include <tbb/enumerable_thread_specific.h>
#include <tbb/parallel_for.h>

#include <algorithm>
#include <cmath>
#include <memory>
#include <vector>

#include "glint/bake/flat_scatter.h"
#include "glint/bake/triangle_splat.h"

namespace glint::bake {
namespace {

/// Lattice nodes per stride: the weights of a footprint are interpolated linearly between nodes.
constexpr int kNodesPerStride = 8;

using NodeRow = std::vector<PackedBins>;  // one entry a node of the lattice
using CellRow = std::vector<CornerBins>;  // one entry a cell of the lattice

/// The lattice of one level along one axis. With wrap, node k and node k + count are the same.
struct Axis {
  float size;     // of the map, texels
  float spacing;  // texels
  int cells;      // of the lattice; nodes: the same with wrap, one more without
  bool wrap;

  int nodes() const { return wrap ? cells : cells + 1; }
  Axis coarser() const { return {size, 2 * spacing, cells / 2, wrap}; }

  /// Relative weight of node k in a Gaussian footprint: summed over its periodic copies, narrowed by what interpolation adds.
  float weight(int k, float centre, float sigma) const {
    const float variance = sigma * sigma - spacing * spacing / 6;
    const float reach = kPyramidReach * sigma;
    float d = static_cast<float>(k) * spacing - centre;
    float sum = 0;
    if (wrap) d -= size * std::floor((d + reach) / size);  // first copy at or right of -reach
    for (; std::fabs(d) <= reach; d += size) {
      sum += std::exp(-0.5f * d * d / variance);
      if (!wrap) break;
    }
    return sum;
  }
};

Axis finestAxis(int size, float stride, int levels, bool wrap) {
  // Every level halves the lattice, so its count is a multiple of a power of two, and its spacing a little finer for it.
  const int multiple = 1 << (levels - 1);
  const int wanted = static_cast<int>(std::ceil(static_cast<float>(size) * kNodesPerStride / stride));
  const int cells = (wanted + multiple - 1) / multiple * multiple;
  return {static_cast<float>(size), static_cast<float>(size) / static_cast<float>(cells), cells, wrap};
}

/// The node rows of one level and the images that they add to.
class Level {
 public:
  Level(const PyramidShape& shape, int level, Axis x, Axis y, int subdivision, const ImageSink& sink)
      : grid_(shape.levels[level]),
        level_(level),
        tiles_(shape.resolution * subdivision / BlockBins::kTile),
        x_(x),
        y_(y),
        sink_(sink),
        image_rows_(grid_.rows),
        rows_left_(grid_.rows) {
    const float sigma = kFootprintPerStride * grid_.stride;
    row_weights_.resize(static_cast<std::size_t>(grid_.rows) * y_.nodes());
    for (int j = 0; j < grid_.rows; ++j) {
      for (int r = 0; r < y_.nodes(); ++r) {
        const float w = y_.weight(r, centre(j), sigma);
        row_weights_[static_cast<std::size_t>(j) * y_.nodes() + r] = w;
        rows_left_[j] += w > 0;
      }
    }
    column_weights_.resize(static_cast<std::size_t>(grid_.columns) * x_.nodes());
    for (int i = 0; i < grid_.columns; ++i)
      for (int k = 0; k < x_.nodes(); ++k)
        column_weights_[static_cast<std::size_t>(i) * x_.nodes() + k] = x_.weight(k, centre(i), sigma);
  }

  /// Adds one row of nodes to every open image and hands over those that are complete.
  void addRow(int r, const NodeRow& nodes) {
    for (int j = 0; j < grid_.rows; ++j) {
      const float row_weight = row_weights_[static_cast<std::size_t>(j) * y_.nodes() + r];
      if (row_weight <= 0) continue;
      if (image_rows_[j].empty()) image_rows_[j].assign(grid_.columns, BlockBins(tiles_));
      const bool complete = --rows_left_[j] == 0;
      tbb::parallel_for(0, grid_.columns, [&](int i) {
        BlockBins& image = image_rows_[j][i];
        for (int k = 0; k < x_.nodes(); ++k) {
          const float w = row_weight * column_weights_[static_cast<std::size_t>(i) * x_.nodes() + k];
          if (w > kSmallestWeight) nodes[k].addTo(image, w);
        }
        if (complete) sink_(level_, i, j, image);
      });
      if (complete) std::vector<BlockBins>().swap(image_rows_[j]);
    }
  }

 private:
  /// Corners of the square around the circle of kPyramidReach deviations.
  static constexpr float kSmallestWeight = 2.2e-3f;  // exp(-3.5^2 / 2)

  float centre(int i) const { return (static_cast<float>(i) + 0.5f) * grid_.stride; }

  PyramidGrid grid_;
  int level_;
  int tiles_;
  Axis x_, y_;
  const ImageSink& sink_;
  std::vector<std::vector<BlockBins>> image_rows_;
  std::vector<int> rows_left_;
  std::vector<float> row_weights_, column_weights_;
};

/// Halves a lattice: coarse node 2-D weights are the tensor square of (1/2, 1, 1/2). Takes fine rows in order, gives coarse rows.
class Halver {
 public:
  Halver(Axis x, Axis y, int tiles) : x_(x), y_(y), scratch_([tiles] { return BlockBins(tiles); }) {}

  /// Keeps a fine row; calls give(row, nodes) for each coarse row that it completes. Rows come in order, but row 0 of a wrapping
  /// lattice may come last, and coarse row 0 of one does.
  template <class Give>
  void push(int r, std::shared_ptr<const NodeRow> row, Give&& give) {
    if (r == 0) first_ = row;
    const bool odd = r % 2;
    if (odd && r > 1) give(r / 2, combine(before_.get(), middle_.get(), row.get()));
    if (odd && r == 1 && !y_.wrap) give(0, combine(nullptr, first_.get(), row.get()));
    if (odd && r == 1 && y_.wrap) second_ = row;
    if (odd)
      before_ = row;
    else
      middle_ = row;
    if (++pushed_ < y_.nodes()) return;
    if (y_.wrap)
      give(0, combine(before_.get(), first_.get(), second_ ? second_.get() : before_.get()));
    else
      give(y_.cells / 2, combine(before_.get(), middle_.get(), nullptr));
  }

 private:
  NodeRow combine(const NodeRow* below, const NodeRow* middle, const NodeRow* above) {
    const Axis coarse = x_.coarser();
    NodeRow out(coarse.nodes());
    tbb::parallel_for(0, coarse.nodes(), [&](int k) {
      BlockBins& sum = scratch_.local();
      const auto addRow = [&](const NodeRow* row, float weight) {
        if (!row) return;
        for (int d = -1; d <= 1; ++d) {
          int column = 2 * k + d;
          if (x_.wrap) column = (column + x_.cells) % x_.cells;
          if (column < 0 || column >= x_.nodes()) continue;
          (*row)[column].addTo(sum, d == 0 ? weight : 0.5f * weight);
        }
      };
      addRow(below, 0.5f);
      addRow(middle, 1);
      addRow(above, 0.5f);
      out[k] = pack(sum);
      sum.clear();
    });
    return out;
  }

  Axis x_, y_;
  tbb::enumerable_thread_specific<BlockBins> scratch_;
  std::shared_ptr<const NodeRow> first_, second_, before_, middle_;
  int pushed_ = 0;  // rows so far
};

/// Rasterises the cells of the map into the corners of lattice cells.
class Rasteriser {
 public:
  Rasteriser(const NormalMap& map, Axis x, Axis y, int bins_per_axis, float sigma_bins)
      : map_(map), x_(x), y_(y), tiles_(bins_per_axis / BlockBins::kTile), splatters_([=] {
          return TriangleSplatter(bins_per_axis, sigma_bins);
        }) {}

  /// Corner histograms of a row of lattice cells; corner = 2 * upper + right.
  CellRow row(int b) {
    CellRow out(x_.cells);
    tbb::parallel_for(0, x_.cells, [&](int a) {
      TriangleSplatter& splatter = splatters_.local();
      double mass[4] = {};
      const auto [j0, j1] = cellsIn(y_, b, map_.height);
      const auto [i0, i1] = cellsIn(x_, a, map_.width);
      for (int j = j0; j < j1; ++j)
        for (int i = i0; i < i1; ++i) addCell(i, j, a, b, splatter, mass);
      out[a] = splatter.extract();
      std::copy_n(mass, 4, out[a].mass);
    });
    return out;
  }

  int tiles() const { return tiles_; }

 private:
  /// Cells of four texel centres whose middle (i + 1) lies in lattice cell `a`; the last cell of a map that does not wrap is none.
  static std::pair<int, int> cellsIn(const Axis& axis, int a, int size) {
    const auto first = [&](int cell) {
      return cell >= axis.cells ? size : static_cast<int>(std::ceil(static_cast<float>(cell) * axis.spacing)) - 1;
    };
    if (!axis.wrap) return {std::max(0, first(a)), std::min(size - 1, a + 1 >= axis.cells ? size - 1 : first(a + 1))};
    return {first(a), a + 1 >= axis.cells ? size - 1 : first(a + 1)};
  }

  void addCell(int i, int j, int a, int b, TriangleSplatter& splatter, double mass[4]) const {
    const int left = i < 0 ? i + map_.width : i, bottom = j < 0 ? j + map_.height : j;
    const int right = left + 1 < map_.width ? left + 1 : 0, top = bottom + 1 < map_.height ? bottom + 1 : 0;
    const Vec2 n00 = map_.at(left, bottom), n10 = map_.at(right, bottom), n01 = map_.at(left, top), n11 = map_.at(right, top);
    for (int half = 0; half < 2; ++half) {
      // Centroids lie a sixth of a texel off the middle of the cell.
      const float sixth = 1.0f / 6, sign = half == 0 ? 1.0f : -1.0f;
      const float tx = (static_cast<float>(i + 1) + sign * sixth) / x_.spacing - static_cast<float>(a);
      const float ty = (static_cast<float>(j + 1) - sign * sixth) / y_.spacing - static_cast<float>(b);
      const float weights[4] = {(1 - tx) * (1 - ty), tx * (1 - ty), (1 - tx) * ty, tx * ty};
      for (int k = 0; k < 4; ++k) mass[k] += weights[k];
      splatter.add(n00, half == 0 ? n10 : n01, n11, weights);
    }
  }

  const NormalMap& map_;
  Axis x_, y_;
  int tiles_;
  tbb::enumerable_thread_specific<TriangleSplatter> splatters_;
};

/// Node (k, r) gathers a corner of each of the four lattice cells around it. `below` and `above` are rows of lattice cells.
NodeRow gatherNodes(const Axis& x, const CellRow* below, const CellRow* above, int tiles) {
  NodeRow nodes(x.nodes());
  tbb::enumerable_thread_specific<BlockBins> scratch([tiles] { return BlockBins(tiles); });
  tbb::parallel_for(0, x.nodes(), [&](int k) {
    BlockBins& sum = scratch.local();
    const int left = k > 0 ? k - 1 : x.wrap ? x.cells - 1 : -1;
    const int right = k < x.cells ? k : -1;
    const auto add = [&](const CellRow* row, int cell, int corner) {
      if (row && cell >= 0) (*row)[cell].addTo(sum, corner);
    };
    add(below, left, 3);
    add(below, right, 2);
    add(above, left, 1);
    add(above, right, 0);
    nodes[k] = pack(sum);
    sum.clear();
  });
  return nodes;
}

}  // namespace

void scatterSmooth(const NormalMap& map, const PyramidShape& shape, int subdivision, const ImageSink& sink,
                   const ProgressFn& progress) {
  const bool wrap = shape.boundary == Boundary::wrap;
  Axis x = finestAxis(map.width, shape.levels[0].stride, shape.level_count, wrap);
  Axis y = finestAxis(map.height, shape.levels[0].stride, shape.level_count, wrap);
  const int bins_per_axis = shape.resolution * subdivision;
  Rasteriser rasteriser(map, x, y, bins_per_axis, 0.5f * shape.sigma_r * static_cast<float>(bins_per_axis));

  std::vector<Level> levels;
  std::vector<std::unique_ptr<Halver>> halvers;
  const Axis finest_x = x, finest_y = y;
  for (int l = 0; l < shape.level_count; ++l) {
    levels.emplace_back(shape, l, x, y, subdivision, sink);
    halvers.push_back(std::make_unique<Halver>(x, y, rasteriser.tiles()));
    x = x.coarser();
    y = y.coarser();
  }
  const std::function<void(int, int, NodeRow)> push = [&](int l, int r, NodeRow nodes) {
    levels[l].addRow(r, nodes);
    if (l + 1 == shape.level_count) return;
    halvers[l]->push(r, std::make_shared<const NodeRow>(std::move(nodes)),
                     [&](int coarse, NodeRow row) { push(l + 1, coarse, std::move(row)); });
  };

  const auto cells = [&](int b) { return rasteriser.row(b); };
  CellRow below = wrap ? cells(finest_y.cells - 1) : CellRow();
  CellRow last = below;
  for (int r = 0; r < finest_y.nodes(); ++r) {
    const bool has_above = r < finest_y.cells;
    CellRow above = !has_above ? CellRow() : wrap && r == finest_y.cells - 1 ? std::move(last) : cells(r);
    push(0, r, gatherNodes(finest_x, below.empty() ? nullptr : &below, above.empty() ? nullptr : &above, rasteriser.tiles()));
    below = std::move(above);
    if (progress) progress(r + 1, finest_y.nodes());
  }
}

}  // namespace glint::bake
