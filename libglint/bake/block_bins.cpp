#include "glint/bake/block_bins.h"

#include "glint/bake/simd.h"

namespace glint::bake {
namespace {

GLINT_MULTIVERSION void addScaled(const float* from, float weight, float* to) {
  for (int k = 0; k < BlockBins::kTileBins; ++k) to[k] += weight * from[k];
}

}  // namespace

void BlockBins::add(std::int32_t tile, const float* values, float weight) {
  std::int32_t& slot = slots_[tile];
  if (slot < 0) {
    slot = static_cast<std::int32_t>(tiles_.size());
    tiles_.push_back(tile);
    values_.resize(values_.size() + kTileBins, 0.0f);
  }
  addScaled(values, weight, values_.data() + static_cast<std::size_t>(slot) * kTileBins);
}

void BlockBins::clear() {
  for (const std::int32_t tile : tiles_) slots_[tile] = -1;
  tiles_.clear();
  values_.clear();
  mass_ = 0;
}

void PackedBins::addTo(BlockBins& bins, float weight) const {
  for (std::size_t k = 0; k < tiles.size(); ++k) bins.add(tiles[k], values.data() + k * BlockBins::kTileBins, weight);
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
