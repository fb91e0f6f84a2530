#include "glint/bake/histogram/histogram_sat.h"

#include <tbb/blocked_range.h>
#include <tbb/parallel_for.h>

#include <algorithm>
#include <cmath>
#include <cstring>
#include <string>

#include "glint/bake/common/slopes.h"
#include "glint/model/error.h"
#include "glint/model/slope_sums.h"
#include "glint/model/texel_name.h"
#include "glint/query/detail/histogram/spherical_bins.h"

namespace glint::bake {
namespace {

constexpr int kTile = HistogramSat::kTileSize;
constexpr std::uint64_t kMostTexels = std::uint64_t{1} << 32;
/// Number of parts in which texels are binned. Results are summed in the order of parts, so they do not depend on threads.
constexpr int kParts = 64;
/// Distance, in texels, of points of the coarse table. A frame of this width and a length of 2K texels has 2^16 texels, as many
/// as the 16-bit counters of the fine table tell apart.
constexpr int kCoarseTexels = 32;
/// Number of counters that one task sums down a table. They stay in the first-level cache.
constexpr std::size_t kColumnCounters = 4096;
/// Rows of a table that are summed before the next ones.
constexpr std::size_t kBandRows = 64;

void checkOptions(const NormalMap& map, const HistogramSatOptions& options) {
  const auto require = [](bool holds, const char* object, const std::string& what, const char* remedy) {
    if (!holds) throw Error(ErrorCode::usage, "option.range", {}, object, what, remedy);
  };
  require(options.theta_bins >= 1 && options.theta_bins <= HistogramSat::kMaxThetaBins && options.phi_bins >= 1 &&
              options.phi_bins <= HistogramSat::kMaxPhiBins && options.theta_bins * options.phi_bins <= HistogramSat::kMaxBins,
          "bins", std::to_string(options.theta_bins) + "x" + std::to_string(options.phi_bins) + " is out of range",
          "give 1 to 64 rings of elevation, 1 to 256 sectors of azimuth, at most 2048 bins");
  require(options.stride >= 1 && options.stride <= HistogramSat::kMaxStride, "stride",
          std::to_string(options.stride) + " is out of range", "give 1 to 128 texels");
  if (static_cast<std::uint64_t>(map.width) * static_cast<std::uint64_t>(map.height) > kMostTexels) {
    throw Error(ErrorCode::unsupported, "histogram.map_size", {}, "",
                "a map of " + std::to_string(map.width) + " x " + std::to_string(map.height) +
                    " texels is more than the counters of a histogram table hold, 2^32",
                "cut the map into tiles");
  }
}

/// Sizes and strides of the tables.
HistogramSat shapeFor(const NormalMap& map, const HistogramSatOptions& options) {
  HistogramSat shape;
  shape.width = map.width;
  shape.height = map.height;
  shape.theta_bins = options.theta_bins;
  shape.phi_bins = options.phi_bins;
  shape.stride = options.stride;
  shape.coarse_stride = options.stride * std::max(1, kCoarseTexels / options.stride);
  // The stride along lines grows with the stride of the tables, so that tables of lines stay the smaller part of the memory.
  shape.line_stride = std::clamp(64 * options.stride, 256, 512);
  return shape;
}

/// Splits [0, count) into kParts parts, and calls visitor(part, begin, end) for each.
template <class Visitor>
void forEachPart(int count, Visitor&& visitor) {
  tbb::parallel_for(0, kParts, [&](int part) {
    const auto begin = static_cast<int>(std::int64_t{count} * part / kParts);
    visitor(part, begin, static_cast<int>(std::int64_t{count} * (part + 1) / kParts));
  });
}

/// Number of texels of each bin of directions, and sums of their normals and slopes.
struct BinStatistics {
  static constexpr std::size_t kBytes = sizeof(std::uint64_t) + 2 * sizeof(double) + sizeof(SlopeSums);  ///< of a bin

  std::vector<std::uint64_t> counts;
  std::vector<double> sums_x, sums_y;
  std::vector<SlopeSums> slopes;

  explicit BinStatistics(int bins) : counts(bins), sums_x(bins), sums_y(bins), slopes(bins) {}
  void add(int bin, Vec2 n) {
    ++counts[bin];
    sums_x[bin] += n.x;
    sums_y[bin] += n.y;
    const Vec2 s = slopeOf(n);
    const double p = s.x, q = s.y;
    slopes[bin].add({p, q, p * p, p * q, q * q});
  }
  void add(const BinStatistics& other) {
    for (std::size_t k = 0; k < counts.size(); ++k) {
      counts[k] += other.counts[k];
      sums_x[k] += other.sums_x[k];
      sums_y[k] += other.sums_y[k];
      slopes[k].add(other.slopes[k]);
    }
  }
};

/// Writes the bin of every texel. Bins are numbered as SphericalBins does, with bins that do not occur.
BinStatistics binTexels(const NormalMap& map, const SphericalBins& bins, HistogramSatData& sat) {
  std::vector<BinStatistics> parts(kParts, BinStatistics(bins.count()));
  forEachPart(sat.shape.tileRows(), [&](int part, int begin, int end) {
    const std::size_t tile_row = static_cast<std::size_t>(sat.shape.tileColumns()) * kTile * kTile;
    std::fill(sat.texels.values.get() + begin * tile_row, sat.texels.values.get() + end * tile_row, std::uint16_t{0});
    for (int j = begin * kTile; j < std::min(end * kTile, map.height); ++j) {
      for (int i = 0; i < map.width; ++i) {
        const Vec2 n = map.at(i, j);
        if (std::isnan(dot(n, n))) {
          throw Error(ErrorCode::invalid_input, "normals.finite", {}, {},
                      "a normal is no number " + texelName(map.width, map.height, rowMajorIndex(i, j, map.width)),
                      "ingest the image again with glint-ingest, which checks it");
        }
        const int bin = bins.find(n);
        parts[part].add(bin, n);
        sat.texels.values[sat.shape.texelIndex(i, j)] = static_cast<std::uint16_t>(bin);
      }
    }
  });
  BinStatistics total(bins.count());
  for (const BinStatistics& part : parts) total.add(part);
  return total;
}

/// Keeps the bins that occur, and writes their new numbers to all texels.
void keepOccurring(const BinStatistics& statistics, HistogramSatData& sat) {
  std::vector<std::uint16_t> place(statistics.counts.size());
  for (std::size_t id = 0; id < statistics.counts.size(); ++id) {
    const std::uint64_t count = statistics.counts[id];
    if (count == 0) continue;
    place[id] = static_cast<std::uint16_t>(sat.bin_ids.size());
    sat.bin_ids.push_back(static_cast<std::uint16_t>(id));
    sat.bin_totals.push_back(count);
    const auto texels = static_cast<double>(count);
    sat.bin_normals.push_back(
        {static_cast<float>(statistics.sums_x[id] / texels), static_cast<float>(statistics.sums_y[id] / texels)});
    sat.bin_slopes.push_back(statistics.slopes[id].moments(texels));
  }
  sat.shape.bin_count = static_cast<int>(sat.bin_ids.size());
  forEachPart(sat.shape.tileRows(), [&](int, int begin, int end) {
    for (int j = begin * kTile; j < std::min(end * kTile, sat.shape.height); ++j) {
      for (int i = 0; i < sat.shape.width; ++i) {
        std::uint16_t& bin = sat.texels.values[sat.shape.texelIndex(i, j)];
        bin = place[bin];
      }
    }
  });
}

/// Sums down a table of `rows` rows: adds each row of counters to the next. Band after band, so that a table in a file is read and
/// written from its beginning to its end.
template <class Counter>
void sumDown(Counter* table, std::size_t rows, std::size_t row_counters) {
  for (std::size_t first = 1; first < rows; first += kBandRows) {
    tbb::parallel_for(std::size_t{0}, (row_counters + kColumnCounters - 1) / kColumnCounters, [&](std::size_t chunk) {
      const std::size_t begin = chunk * kColumnCounters, end = std::min(begin + kColumnCounters, row_counters);
      for (std::size_t b = first; b < std::min(first + kBandRows, rows); ++b) {
        const Counter* above = table + (b - 1) * row_counters;
        Counter* here = table + b * row_counters;
        for (std::size_t k = begin; k < end; ++k) here[k] = static_cast<Counter>(here[k] + above[k]);
      }
    });
  }
}

/// Builds the summed-area table with points at every `stride` texels.
template <class Counter>
void buildTable(const HistogramSatData& sat, int stride, CounterArray<Counter>& table, ProgressCounter& progress) {
  const HistogramSat& shape = sat.shape;
  const std::size_t length = shape.rowLength();
  const std::size_t points_x = shape.pointsX(stride), points_y = shape.pointsY(stride);
  table.allocate(points_x * points_y * length);
  std::fill_n(table.values.get(), points_x * length, Counter{0});
  tbb::parallel_for(std::size_t{1}, points_y, [&](std::size_t b) {
    Counter* row = table.values.get() + b * points_x * length;
    std::fill_n(row, length, Counter{0});
    const int top = static_cast<int>(std::min<std::int64_t>(static_cast<std::int64_t>(b) * stride, shape.height));
    // Count the texels of each cell, and add the counts of all cells before it in the row.
    for (std::size_t a = 1; a < points_x; ++a) {
      Counter* here = row + a * length;
      std::memcpy(here, here - length, length * sizeof(Counter));
      const int right = static_cast<int>(std::min<std::int64_t>(static_cast<std::int64_t>(a) * stride, shape.width));
      for (int j = (static_cast<int>(b) - 1) * stride; j < top; ++j)
        for (int i = (static_cast<int>(a) - 1) * stride; i < right; ++i) ++here[sat.texels.values[shape.texelIndex(i, j)]];
    }
    progress.advance();
  });
  sumDown(table.values.get(), points_y, points_x * length);
}

/// Builds the table of sums along every row (or column) of texels.
template <bool kColumns>
void buildLines(const HistogramSatData& sat, CounterArray<std::uint16_t>& table, ProgressCounter& progress) {
  const HistogramSat& shape = sat.shape;
  const int stride = shape.line_stride, lines = kColumns ? shape.width : shape.height;
  const int texels = kColumns ? shape.height : shape.width;
  const std::size_t length = shape.rowLength();
  const std::size_t points = kColumns ? shape.pointsY(stride) : shape.pointsX(stride);
  table.allocate(static_cast<std::size_t>(lines) * points * length);
  // One task has all lines of a tile, whose texels lie side by side in memory.
  tbb::parallel_for(0, (lines + kTile - 1) / kTile, [&](int tile) {
    for (int line = tile * kTile; line < std::min((tile + 1) * kTile, lines); ++line) {
      std::uint16_t* here = table.values.get() + static_cast<std::size_t>(line) * points * length;
      std::fill_n(here, length, std::uint16_t{0});
      for (std::size_t a = 1; a < points; ++a, here += length) {
        std::memcpy(here + length, here, length * sizeof *here);
        const int begin = (static_cast<int>(a) - 1) * stride;
        for (int k = begin; k < std::min(begin + stride, texels); ++k)
          ++here[length + sat.texels.values[kColumns ? shape.texelIndex(line, k) : shape.texelIndex(k, line)]];
      }
    }
    progress.advance();
  });
}

}  // namespace

HistogramSat HistogramSatData::view() const {
  HistogramSat sat = shape;
  sat.bin_ids = bin_ids;
  sat.bin_normals = bin_normals;
  sat.bin_slopes = bin_slopes;
  sat.bin_totals = bin_totals;
  sat.texels = texels.view();
  sat.sums = sums.view();
  sat.coarse_sums = coarse_sums.view();
  sat.row_sums = row_sums.view();
  sat.column_sums = column_sums.view();
  return sat;
}

std::size_t HistogramSatData::sizeBytes() const {
  const HistogramSat sat = view();
  return sat.bin_ids.size_bytes() + sat.bin_normals.size_bytes() + sat.bin_slopes.size_bytes() + sat.bin_totals.size_bytes() +
         sat.texels.size_bytes() + sat.sums.size_bytes() + sat.coarse_sums.size_bytes() + sat.row_sums.size_bytes() +
         sat.column_sums.size_bytes();
}

double histogramStatisticsBytes(const HistogramSatOptions& options) {
  // Of each part, and of all.
  return (kParts + 1.0) * options.theta_bins * options.phi_bins * static_cast<double>(BinStatistics::kBytes);
}

HistogramSatData buildHistogramSat(const NormalMap& map, const HistogramSatOptions& options, const ProgressFn& progress) {
  checkOptions(map, options);
  HistogramSatData sat;
  sat.shape = shapeFor(map, options);
  sat.shape.slopes = mapSlopes(map);
  const HistogramSat& shape = sat.shape;
  sat.texels.allocate(static_cast<std::size_t>(shape.tileColumns()) * shape.tileRows() * kTile * kTile);
  // Bin the texels, then count them in every table.
  const SphericalBins bins(options.theta_bins, options.phi_bins);
  keepOccurring(binTexels(map, bins, sat), sat);
  ProgressCounter counter(progress, static_cast<std::size_t>(shape.pointsY(shape.stride)) + shape.pointsY(shape.coarse_stride) -
                                        2 + shape.tileRows() + shape.tileColumns());
  buildTable(sat, shape.stride, sat.sums, counter);
  buildTable(sat, shape.coarse_stride, sat.coarse_sums, counter);
  buildLines<false>(sat, sat.row_sums, counter);
  buildLines<true>(sat, sat.column_sums, counter);
  return sat;
}

}  // namespace glint::bake
