#include "glint/bake/block_bins.h"

#include "glint/bake/simd.h"

namespace glint::bake {
namespace {

/// to[slots[k]] += weight * from[k] for tiles of 64 values.
GLINT_MULTIVERSION void addTiles(const std::int32_t* slots, std::size_t count, const float* from, std::size_t step,
                                 float weight, float* to) {
  for (std::size_t k = 0; k < count; ++k, from += step) {
    float* tile = to + static_cast<std::size_t>(slots[k]) * BlockBins::kTileBins;
    for (int i = 0; i < BlockBins::kTileBins; ++i) tile[i] += weight * from[i];
  }
}

}  // namespace

void BlockBins::add(const std::vector<std::int32_t>& tiles, const float* values, std::size_t step, float weight) {
  scratch_.resize(tiles.size());
  for (std::size_t k = 0; k < tiles.size(); ++k) {
    std::int32_t& slot = slots_[tiles[k]];
    if (slot < 0) {
      slot = static_cast<std::int32_t>(tiles_.size());
      tiles_.push_back(tiles[k]);
    }
    scratch_[k] = slot;
  }
  values_.resize(tiles_.size() * kTileBins, 0.0f);
  addTiles(scratch_.data(), tiles.size(), values, step, weight, values_.data());
}

void CornerBins::addTo(BlockBins& bins, int corner) const {
  bins.add(tiles, values.data() + corner * BlockBins::kTileBins, 4 * BlockBins::kTileBins, 1);
  bins.addMass(mass[corner]);
}

void BlockBins::clear() {
  for (const std::int32_t tile : tiles_) slots_[tile] = -1;
  tiles_.clear();
  values_.clear();
  mass_ = 0;
}

void PackedBins::addTo(BlockBins& bins, float weight) const {
  bins.add(tiles, values.data(), BlockBins::kTileBins, weight);
  bins.addMass(weight * mass);
}

PackedBins pack(const BlockBins& bins) {
  PackedBins packed;
  packed.tiles = bins.tiles();
  packed.values.assign(bins.values(0), bins.values(bins.tiles().size()));
  packed.mass = bins.mass();
  return packed;
}

}  // namespace glint::bake
