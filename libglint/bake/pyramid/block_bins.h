#pragma once

#include <cstdint>
#include <vector>

namespace glint::bake {

/// Bins of directions in square tiles of kTile x kTile, of which only those in use are stored: histograms of a patch of a
/// surface, one or several over the same tiles.
class BlockBins {
 public:
  static constexpr int kTile = 8;
  static constexpr int kTileBins = kTile * kTile;

  /// @param tiles     that there are
  /// @param channels  histograms
  explicit BlockBins(std::size_t tiles = 0, int channels = 1)
      : tile_floats_(static_cast<std::size_t>(channels) * kTileBins), slots_(tiles, -1) {}

  /// Tiles in use, in the order of their first use.
  const std::vector<std::int32_t>& tiles() const { return tiles_; }
  /// [channels][64] of the k-th tile in use.
  const float* values(std::size_t k) const { return values_.data() + k * tile_floats_; }
  /// The same of any tile, taken into use with zeros; valid until the next tile is.
  float* take(std::int32_t tile) {
    std::int32_t& slot = slots_[tile];
    if (slot < 0) {
      slot = static_cast<std::int32_t>(tiles_.size());
      tiles_.push_back(tile);
      values_.resize(values_.size() + tile_floats_);
    }
    return values_.data() + static_cast<std::size_t>(slot) * tile_floats_;
  }
  /// Sum of all values.
  double sum() const;
  /// Forgets all tiles and keeps the memory.
  void clear();

 private:
  std::size_t tile_floats_;
  std::vector<std::int32_t> slots_;  // of each tile: its place in tiles_, or -1
  std::vector<std::int32_t> tiles_;
  std::vector<float> values_;
};

/// Histograms of a surface patch, each weighted by one of the moments 1, x, y, xy of the position in a lattice cell: from them
/// follows the histogram under any weight that is bilinear over the cell. Cells cover [-1/2, 1/2]^2.
inline constexpr int kMoments = 4;

/// A weight that is linear over a cell: mean + slope * x.
struct LinearWeight {
  float mean, slope;
};

/// Integrates x out: adds the moments 1 and y under a weight along x to two channels.
void addAlongX(const BlockBins& moments, LinearWeight weight, BlockBins& sums);
/// Integrates y out: adds two channels, the moments 1 and y, under a weight along y to one.
void addAlongY(const BlockBins& sums, LinearWeight weight, BlockBins& bins);

/// Where a cell lies in a larger one along one axis: its x is scale * x + middle there.
struct CellPart {
  float scale, middle;

  static constexpr CellPart half(bool high) { return {0.5f, high ? 0.25f : -0.25f}; }
  static constexpr CellPart whole() { return {1, 0}; }
};
/// Adds the moments of a part of a cell to those of the cell.
void addPart(const BlockBins& part, CellPart x, CellPart y, BlockBins& cell);

}  // namespace glint::bake
