#include "glint/bake/block_bins.h"

#include "glint/bake/simd.h"

namespace glint::bake {
namespace {

constexpr int kBins = BlockBins::kTileBins;

/// to[c] += weight.mean * from[2c] + weight.slope * from[2c + 1] for channels c of 64 values.
GLINT_MULTIVERSION void addTiles(const BlockBins& from, LinearWeight weight, int channels, BlockBins& to) {
  for (std::size_t t = 0; t < from.tiles().size(); ++t) {
    const float* in = from.values(t);
    float* out = to.take(from.tiles()[t]);
    for (int c = 0; c < channels; ++c, in += 2 * kBins, out += kBins)
      for (int k = 0; k < kBins; ++k) out[k] += weight.mean * in[k] + weight.slope * in[kBins + k];
  }
}

/// The quarter's x is x / 2 + cx in the cell, and so is y.
GLINT_MULTIVERSION void addQuarterTiles(const BlockBins& from, float cx, float cy, BlockBins& to) {
  const float half_cx = 0.5f * cx, half_cy = 0.5f * cy, both = cx * cy;
  for (std::size_t t = 0; t < from.tiles().size(); ++t) {
    const float* in = from.values(t);
    float* out = to.take(from.tiles()[t]);
    for (int k = 0; k < kBins; ++k) {
      const float one = in[k], x = in[kBins + k], y = in[2 * kBins + k], xy = in[3 * kBins + k];
      out[k] += one;
      out[kBins + k] += 0.5f * x + cx * one;
      out[2 * kBins + k] += 0.5f * y + cy * one;
      out[3 * kBins + k] += 0.25f * xy + half_cy * x + half_cx * y + both * one;
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

void addQuarter(const BlockBins& quarter, bool right, bool upper, BlockBins& cell) {
  addQuarterTiles(quarter, right ? 0.25f : -0.25f, upper ? 0.25f : -0.25f, cell);
}

}  // namespace glint::bake
