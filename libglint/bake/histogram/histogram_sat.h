#pragma once

#include <cstddef>
#include <cstdint>
#include <span>
#include <vector>

#include "glint/bake/common/large_array.h"
#include "glint/bake/common/progress.h"
#include "glint/model/histogram_sat.h"
#include "glint/model/normal_map.h"

namespace glint::bake {

struct HistogramSatOptions {
  int theta_bins = 9;  ///< rings of elevation, 1..64
  int phi_bins = 32;   ///< sectors of azimuth, 1..256; at most 2048 bins in all
  int stride = 8;  ///< texels between points of the fine table, 1..128; small strides take memory, large ones time of queries
};

/// A LargeArray and its size.
template <class T>
struct CounterArray {
  LargeArray<T> values;
  std::size_t size = 0;

  void allocate(std::size_t count) {
    values = makeLargeArray<T>(count);
    size = count;
  }
  std::span<const T> view() const { return {values.get(), size}; }
};

/// A HistogramSat that owns its arrays.
class HistogramSatData {
 public:
  HistogramSat shape;  ///< sizes, strides and slopes; its spans are empty
  std::vector<std::uint16_t> bin_ids;
  std::vector<Vec2> bin_normals;
  std::vector<MapSlopes> bin_slopes;
  std::vector<std::uint64_t> bin_totals;
  CounterArray<std::uint16_t> texels, sums, row_sums, column_sums;
  CounterArray<std::uint32_t> coarse_sums;

  /// Spans over the arrays; valid while this object lives and is not changed.
  HistogramSat view() const;
  std::size_t sizeBytes() const;
};

/// The memory of statistics of bins that buildHistogramSat takes beside the arrays of a HistogramSatData, bytes.
double histogramStatisticsBytes(const HistogramSatOptions& options);

/// Accumulates the histograms of a map (Gamboa 2018, section 4.1).
///
/// Each texel gets the bin of its normal. Then each table counts the texels of its cells, and sums counts along rows and down
/// columns: every counter is written once and added to once. Sums of integers do not depend on the number of threads. Tables are
/// in memory of the default resource, written and read from their beginnings on, so that they may be in files.
/// @throws Error (usage) for options out of range; (unsupported) for maps of more than 2^32 texels
HistogramSatData buildHistogramSat(const NormalMap& map, const HistogramSatOptions& options, const ProgressFn& progress = {});

}  // namespace glint::bake
