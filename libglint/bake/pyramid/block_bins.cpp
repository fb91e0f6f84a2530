#include "glint/bake/pyramid/block_bins.h"

#include "glint/bake/common/simd.h"

namespace glint::bake {
namespace {

constexpr int kBins = BlockBins::kTileBins;

/// to[c] += weight.mean * from[2c] + weight.slope * from[2c + 1] for each channel c of each tile.
GLINT_MULTIVERSION void addTiles(const BlockBins& from, LinearWeight weight, int channels, BlockBins& to) {
  for (std::size_t t = 0; t < from.tiles().size(); ++t) {
    const float* in = from.values(t);
    float* out = to.take(from.tiles()[t]);
    for (int c = 0; c < channels; ++c, in += 2 * kBins, out += kBins)
      for (int k = 0; k < kBins; ++k) out[k] += weight.mean * in[k] + weight.slope * in[kBins + k];
  }
}

/// Moments after the change of variables x -> px.scale x + px.middle, y -> py.scale y + py.middle.
GLINT_MULTIVERSION void addPartTiles(const BlockBins& from, CellPart px, CellPart py, BlockBins& to) {
  const float sx = px.scale, cx = px.middle, sy = py.scale, cy = py.middle;
  const float of_xy = sx * sy, of_x = sx * cy, of_y = sy * cx, of_one = cx * cy;
  for (std::size_t t = 0; t < from.tiles().size(); ++t) {
    const float* in = from.values(t);
    float* out = to.take(from.tiles()[t]);
    for (int k = 0; k < kBins; ++k) {
      const float one = in[k], x = in[kBins + k], y = in[2 * kBins + k], xy = in[3 * kBins + k];
      out[k] += one;
      out[kBins + k] += sx * x + cx * one;
      out[2 * kBins + k] += sy * y + cy * one;
      out[3 * kBins + k] += of_xy * xy + of_x * x + of_y * y + of_one * one;
    }
  }
}

}  // namespace

double BlockBins::sum() const {
  double sum = 0;
  for (std::size_t k = 0; k < values_.size(); k += kTileBins) {
    float tile = 0;
    for (int i = 0; i < kTileBins; ++i) tile += values_[k + i];
    sum += tile;
  }
  return sum;
}

void BlockBins::clear() {
  for (const std::int32_t tile : tiles_) slots_[tile] = -1;
  tiles_.clear();
  values_.clear();
}

void addAlongX(const BlockBins& moments, LinearWeight weight, BlockBins& sums) { addTiles(moments, weight, 2, sums); }

void addAlongY(const BlockBins& sums, LinearWeight weight, BlockBins& bins) { addTiles(sums, weight, 1, bins); }

void addPart(const BlockBins& part, CellPart x, CellPart y, BlockBins& cell) { addPartTiles(part, x, y, cell); }

}  // namespace glint::bake
