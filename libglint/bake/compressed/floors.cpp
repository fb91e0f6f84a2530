#include "glint/bake/compressed/floors.h"

#include <algorithm>
#include <bit>

#include "glint/math/half.h"
#include "glint/query/detail/pyramid/block_mass.h"

namespace glint::bake {
namespace {

// Bins are an eighth of an octave wide: the exponent and the first three bits of the mantissa number them.
constexpr int kMantissaBits = 3, kShift = 23 - kMantissaBits;
constexpr float kLowest = 0x1p-40f;  // pixels below this, in units of the peak, share the first bin
constexpr int kBins = 64 << kMantissaBits;

std::uint32_t numberOf(float value) { return std::bit_cast<std::uint32_t>(value) >> kShift; }

/// @param value  > 0
int binOf(float value) {
  const std::int64_t bin = std::int64_t{numberOf(value)} - numberOf(kLowest);
  return static_cast<int>(std::clamp<std::int64_t>(bin, 0, kBins - 1));
}

/// @return least value of a bin
float lowEdge(int bin) {
  return bin == 0 ? 0 : std::bit_cast<float>((numberOf(kLowest) + static_cast<std::uint32_t>(bin)) << kShift);
}

}  // namespace

float ClusterFloors::at(int cell) const { return halfToFloat(unit) * blockMass(codes[static_cast<std::size_t>(cell)]); }

FloorFinder::FloorFinder(const BlockScale& scale, float density) : density_(density), bins_(kFloorCells * kBins) {
  for (int p = 0; p < kBlockPixels; ++p) unscale_[p] = 1 / (scale.x[p % kBlockSize] * scale.y[p / kBlockSize]);
}

void FloorFinder::add(const float* slice, const float* decoded) {
  for (int p = 0; p < kBlockPixels; ++p) {
    const auto cell = static_cast<std::size_t>(floorCell(p % kBlockSize, p / kBlockSize));
    truth_[cell] += static_cast<double>(unscale_[p] * slice[p]);
    const float value = unscale_[p] * decoded[p];
    if (!(value > 0)) continue;
    Bin& bin = bins_[cell * kBins + static_cast<std::size_t>(binOf(value))];
    ++bin.count;
    bin.sum += value;
  }
}

/// Walks down from the largest pixels until those above the floor, less the floor, add up to the truth.
float FloorFinder::floorOf(int cell) const {
  const Bin* bins = bins_.data() + static_cast<std::size_t>(cell) * kBins;
  double count = 0, sum = 0, left_above = 0;
  for (int b = kBins - 1; b >= 0; --b) {
    count += bins[b].count;
    sum += bins[b].sum;
    const double low = lowEdge(b), left = sum - low * count, truth = truth_[static_cast<std::size_t>(cell)];
    if (left > truth) return static_cast<float>(low + (lowEdge(b + 1) - low) * (left - truth) / (left - left_above));
    left_above = left;
  }
  return 0;
}

ClusterFloors FloorFinder::find() const {
  std::array<float, kFloorCells> floors;
  for (int cell = 0; cell < kFloorCells; ++cell) floors[static_cast<std::size_t>(cell)] = density_ * floorOf(cell);
  const float most = *std::max_element(floors.begin(), floors.end());
  ClusterFloors out;
  out.unit = floatToHalf(most);
  const float unit = halfToFloat(out.unit);
  if (!(unit > 0)) return out;
  for (std::size_t cell = 0; cell < floors.size(); ++cell) out.codes[cell] = blockMassCode(floors[cell] / unit);
  return out;
}

}  // namespace glint::bake
