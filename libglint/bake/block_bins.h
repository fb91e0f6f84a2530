#pragma once

#include <cstdint>
#include <vector>

namespace glint::bake {

/// Bins of directions in square tiles of kTile x kTile, of which only those in use are stored: the histogram of a patch of a
/// surface. Tiles are numbered over a grid with one tile of margin around the square of directions.
class BlockBins {
 public:
  static constexpr int kTile = 8;
  static constexpr int kTileBins = kTile * kTile;

  /// @param tiles_per_axis  of the square, without the margin
  explicit BlockBins(int tiles_per_axis = 0)
      : slots_(static_cast<std::size_t>(tiles_per_axis + 2) * (tiles_per_axis + 2), -1) {}

  /// Tiles in use, in the order of their first use.
  const std::vector<std::int32_t>& tiles() const { return tiles_; }
  const float* values(std::size_t k) const { return values_.data() + k * kTileBins; }
  /// Weight of the surface that was added, per unit of mass.
  double mass() const { return mass_; }

  /// Adds weight * (64 values) to each of some tiles. Values of neighbouring tiles are `step` floats apart.
  void add(const std::vector<std::int32_t>& tiles, const float* values, std::size_t step, float weight);
  void addMass(double mass) { mass_ += mass; }
  void clear();

 private:
  std::vector<std::int32_t> slots_;  // of each tile of the grid: its place in tiles_, or -1
  std::vector<std::int32_t> tiles_;
  std::vector<float> values_;
  std::vector<std::int32_t> scratch_;
  double mass_ = 0;
};

/// Four histograms over the same tiles, one for each corner of a lattice cell.
struct CornerBins {
  std::vector<std::int32_t> tiles;
  std::vector<float> values;  ///< [tiles][4][64]
  double mass[4] = {};

  void addTo(BlockBins& bins, int corner) const;
};

/// The same as BlockBins, frozen: compact and without the lookup table.
struct PackedBins {
  std::vector<std::int32_t> tiles;
  std::vector<float> values;  ///< [tiles][64]
  double mass = 0;

  void addTo(BlockBins& bins, float weight) const;
};

PackedBins pack(const BlockBins& bins);

}  // namespace glint::bake
