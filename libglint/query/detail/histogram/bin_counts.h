#pragma once

#include <algorithm>
#include <cstdint>

#include "glint/math/device.h"
#include "glint/model/histogram_sat.h"

namespace glint {

/// Units of covered area in one texel. Areas are summed as integers of this unit: exact for whole texels, and faster to add to
/// memory than floating-point numbers.
inline constexpr double kAreaUnits = 4294967296.0;

/// Memory for the sums of all bins.
struct BinCounts {
  /// Areas are kept in four rows, so that consecutive texels of one bin need not wait for each other's addition.
  static constexpr int kLanes = 4;
  static constexpr int kLaneStride =
      HistogramSat::kMaxBins + 24;        ///< not a multiple of 4 KiB: processors take such addresses for the same one
  double totals[HistogramSat::kMaxBins];  ///< area of each bin after finish(), texels; >= 0
  std::uint32_t whole[HistogramSat::kMaxBins];
  std::int64_t areas[kLanes * kLaneStride];  ///< in 1 / kAreaUnits of a texel
};

/// Sums the covered area of every bin. Exact for whole texels, up to 2^53.
class AllBins {
 public:
  GLINT_HD AllBins(const HistogramSat& sat, BinCounts& counts)
      : totals_(counts.totals),
        whole_(counts.whole),
        areas_(counts.areas),
        bin_totals_(sat.bin_totals.data()),
        count_(sat.bin_count),
        stride_(sat.rowLength()) {
    std::fill_n(totals_, stride_, 0.0);
    std::fill_n(whole_, stride_, 0u);
    for (int lane = 0; lane < BinCounts::kLanes; ++lane)
      std::fill_n(areas_ + lane * BinCounts::kLaneStride, stride_, std::int64_t{0});
  }

  /// @param area  from `areaUnits`
  GLINT_HD void addTexel(int bin, int lane, std::int64_t area) { areas_[lane * BinCounts::kLaneStride + bin] += area; }

  /// Adds weight * (a - b - c + d) for every bin. Counters are subtracted modulo their type.
  template <class Counter>
  GLINT_HD void addCorners(const Counter* a, const Counter* b, const Counter* c, const Counter* d, double weight) {
    if constexpr (sizeof(Counter) == sizeof(std::uint16_t))
      if (weight == 1) return addWhole([=](int k) { return static_cast<std::uint16_t>(a[k] - b[k] - c[k] + d[k]); });
    for (int k = 0; k < stride_; ++k)
      totals_[k] += weight * static_cast<double>(static_cast<Counter>(a[k] - b[k] - c[k] + d[k]));
  }
  /// Adds weight times the counts of the frame between an outer and an inner rectangle, modulo 2^16. Corners as in addCorners.
  GLINT_HD void addFrame(const std::uint16_t* const (&outer)[4], const std::uint16_t* const (&inner)[4], double weight) {
    const std::uint16_t *a = outer[0], *b = outer[1], *c = outer[2], *d = outer[3];
    const std::uint16_t *e = inner[0], *f = inner[1], *g = inner[2], *h = inner[3];
    const auto between = [=](int k) {
      return static_cast<std::uint16_t>((a[k] - b[k] - c[k] + d[k]) - (e[k] - f[k] - g[k] + h[k]));
    };
    if (weight == 1) return addWhole(between);
    for (int k = 0; k < stride_; ++k) totals_[k] += weight * static_cast<double>(between(k));
  }
  GLINT_HD void addDifference(const std::uint16_t* after, const std::uint16_t* before, double weight) {
    for (int k = 0; k < stride_; ++k)
      totals_[k] += weight * static_cast<double>(static_cast<std::uint16_t>(after[k] - before[k]));
  }
  GLINT_HD void addMap(double weight) {
    for (int k = 0; k < count_; ++k) totals_[k] += weight * static_cast<double>(bin_totals_[k]);
  }

  /// Completes `totals`: call once, at the end.
  GLINT_HD void finish() {
    for (int k = 0; k < stride_; ++k) {
      constexpr int kLane = BinCounts::kLaneStride;
      const std::int64_t area = (areas_[k] + areas_[kLane + k]) + (areas_[2 * kLane + k] + areas_[3 * kLane + k]);
      const double total = totals_[k] + static_cast<double>(whole_[k]) + static_cast<double>(area) * (1 / kAreaUnits);
      totals_[k] = total > 0 ? total : 0;
    }
  }

 private:
  /// Number of differences of 16 bits whose sum fits 32 bits.
  static constexpr int kMostDifferences = 65536;

  /// Adds difference(bin), 16 bits, for every bin. Compilers vectorise the loop by eight.
  template <class Difference>
  GLINT_HD void addWhole(Difference difference) {
    if (differences_ == kMostDifferences) {
      for (int k = 0; k < stride_; ++k) totals_[k] += static_cast<double>(whole_[k]);
      std::fill_n(whole_, stride_, 0u);
      differences_ = 0;
    }
    ++differences_;
    // Local copies: the compiler knows that writing sums cannot change them.
    std::uint32_t* sums = whole_;
    const int count = stride_;
    for (int k = 0; k < count; ++k) sums[k] += difference(k);
  }

  double* totals_;
  std::uint32_t* whole_;
  std::int64_t* areas_;
  const std::uint64_t* bin_totals_;
  int count_;
  int stride_;
  int differences_ = 0;
};

/// Sums the texels of one bin.
class OneBin {
 public:
  GLINT_HD OneBin(const HistogramSat& sat, int bin) : sat_(sat), bin_(bin) {}

  GLINT_HD void addTexel(int bin, int lane, std::int64_t area) { areas_[lane] += bin == bin_ ? area : 0; }
  template <class Counter>
  GLINT_HD void addCorners(const Counter* a, const Counter* b, const Counter* c, const Counter* d, double weight) {
    total_ += weight * static_cast<double>(static_cast<Counter>(a[bin_] - b[bin_] - c[bin_] + d[bin_]));
  }
  GLINT_HD void addFrame(const std::uint16_t* const (&outer)[4], const std::uint16_t* const (&inner)[4], double weight) {
    const auto inside = [&](const std::uint16_t* const(&c)[4]) { return c[0][bin_] - c[1][bin_] - c[2][bin_] + c[3][bin_]; };
    total_ += weight * static_cast<double>(static_cast<std::uint16_t>(inside(outer) - inside(inner)));
  }
  GLINT_HD void addDifference(const std::uint16_t* after, const std::uint16_t* before, double weight) {
    total_ += weight * static_cast<double>(static_cast<std::uint16_t>(after[bin_] - before[bin_]));
  }
  GLINT_HD void addMap(double weight) { total_ += weight * static_cast<double>(sat_.bin_totals.data()[bin_]); }
  GLINT_HD double count() const {
    const std::int64_t area = (areas_[0] + areas_[1]) + (areas_[2] + areas_[3]);
    return std::max(0.0, total_ + static_cast<double>(area) * (1 / kAreaUnits));
  }

 private:
  const HistogramSat& sat_;
  int bin_;
  double total_ = 0;
  std::int64_t areas_[BinCounts::kLanes] = {};
};

}  // namespace glint
