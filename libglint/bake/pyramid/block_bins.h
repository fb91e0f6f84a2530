#pragma once

#include <cstdint>
#include <vector>

namespace glint::bake {

/// Histograms of the directions of a patch of a surface. Bins lie in square tiles of kTile x kTile bins, and only tiles in use
/// are stored. There are one or several histograms (channels) over the same tiles.
class BlockBins {
 public:
  static constexpr int kTile = 8;
  static constexpr int kTileBins = kTile * kTile;

  /// @param tiles     number of tiles that can be used
  /// @param channels  number of histograms
  explicit BlockBins(std::size_t tiles = 0, int channels = 1)
      : tile_floats_(static_cast<std::size_t>(channels) * kTileBins), slots_(tiles, -1) {}

  /// Tiles in use, in the order of their first use.
  const std::vector<std::int32_t>& tiles() const { return tiles_; }
  /// Values of the k-th tile in use, [channels][64].
  const float* values(std::size_t k) const { return values_.data() + k * tile_floats_; }
  /// Values of any tile, [channels][64]. Takes the tile into use, with zeros, if it was not. Valid until another tile is taken
  /// into use.
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
  std::vector<std::int32_t> slots_;  // [tiles]: index of the tile in tiles_, or -1
  std::vector<std::int32_t> tiles_;
  std::vector<float> values_;
};

/// Number of moments. The part of a surface in a cell of the lattice has one histogram for each of the weights 1, x, y and xy,
/// where (x, y) is the position in the cell, in [-1/2, 1/2]^2. From these four follows the histogram under any weight that is
/// bilinear over the cell.
inline constexpr int kMoments = 4;

/// A weight that is linear over a cell: mean + slope * x.
struct LinearWeight {
  float mean, slope;
};

/// Applies a weight along x: adds the moments 1 and y under this weight to the two channels of `sums`.
void addAlongX(const BlockBins& moments, LinearWeight weight, BlockBins& sums);
/// Applies a weight along y to the moments 1 and y: adds the histogram under both weights to the one channel of `bins`.
void addAlongY(const BlockBins& sums, LinearWeight weight, BlockBins& bins);

/// Position of a cell inside a larger cell, along one axis: x of the cell is scale * x + middle of the larger cell.
struct CellPart {
  float scale, middle;

  static constexpr CellPart half(bool high) { return {0.5f, high ? 0.25f : -0.25f}; }
  static constexpr CellPart whole() { return {1, 0}; }
};
/// Adds the moments of a part of a cell to the moments of the cell.
void addPart(const BlockBins& part, CellPart x, CellPart y, BlockBins& cell);

}  // namespace glint::bake
