#pragma once

#include <algorithm>
#include <cmath>
#include <cstdint>

#include "glint/model/histogram_sat.h"
#include "glint/query/detail/common/footprint_weights.h"
#include "glint/query/detail/common/sampling.h"
#include "glint/query/detail/histogram/bin_counts.h"
#include "glint/query/detail/histogram/parallelogram_strips.h"
#include "glint/query/detail/histogram/parallelogram_sums.h"
#include "glint/query/detail/histogram/rectangle_sums.h"
#include "glint/query/detail/histogram/spherical_bins.h"
#include "glint/query/detail/moments/slope_lobe.h"
#include "glint/query/ndf_model.h"

namespace glint {

/// Number of nested boxes that stand for a Gaussian footprint.
enum class GaussianBoxes : std::uint8_t {
  one = 1,    ///< the box of the same second moments
  three = 3,  ///< three boxes that together have the same second moments and the least squared difference from the Gaussian
};

/// Where the normals of a bin are, between the borders of the bin.
enum class HistogramBins : std::uint8_t {
  even,  ///< spread evenly over the bin, as a histogram is drawn. Lights smaller than a bin show its borders
  /// A lobe of slopes with the mean and the spread that the texels of the bin have over the whole map, blurred by the lobe of a
  /// facet. Continuous in the half vector, but in the outermost ring of bins, whose slopes have no useful moments: even there.
  lobes,
};

/// Share of a footprint with slanted sides that HistogramNdf may count in a wrong place, unless it is told otherwise.
inline constexpr float kSlantTolerance = 0.06f;

/// The NDF from accumulated histograms of normals (Gamboa 2018, section 4.1).
///
/// Texels count by their covered area; the plane is periodic.
///  - Boxes along the axes are exact at any size.
///  - Boxes at an angle are cut into strips that misplace at most a given share of the footprint. The share bounds the total
///    variation from the exact histogram. Small or thin boxes are exact, and all boxes with a tolerance of 0.
///  - A Gaussian is answered as the parallelogram of the same covariance, or as three of them.
/// Counts say which bins the normals of a footprint are in, and HistogramBins where they are in a bin. With lobes, the density is a
/// mixture of a lobe for each bin (SlopeLobe). With even bins it is constant over the area of a bin on the disk, without further blur:
/// bins are some ten degrees wide. Both integrate to 1 over the disk, and a bin has the mass of its count.
/// A histogram knows directions to a bin. It is meant for lights of six degrees and more (deviation of .1 on the disk); under smaller
/// ones the light of a footprint may be that of the bin's normals elsewhere on the map.
/// Cost of an axis-aligned box: four rows of counters, and a few texels for each texel along a border of up to some hundred
/// texels. Cost at an angle: the same for each of about 1 / tolerance strips, or O(stride * border) for an exact answer.
/// Thread-safe, allocates nothing; the arrays must outlive it.
class HistogramNdf {
  static constexpr float kHistogramRoughness = 0.005f;

 public:
  /// @param slant_tolerance  share of a footprint with slanted sides that may be misplaced, >= 0; 0: none, all boxes are exact
  /// @param shape            where the normals of a bin are; with lobes a density and a mean cost O(bins)
  /// @param sigma_r          with lobes: intrinsic roughness of the facets, disk units
  GLINT_HD explicit HistogramNdf(const HistogramSat& sat, GaussianBoxes gaussian = GaussianBoxes::one,
                                 float slant_tolerance = kSlantTolerance, HistogramBins shape = HistogramBins::even,
                                 float sigma_r = kHistogramRoughness)
      : sat_(sat),
        bins_(sat.theta_bins, sat.phi_bins),
        gaussian_(gaussian),
        slant_tolerance_(slant_tolerance),
        shape_(shape),
        sigma_r_(sigma_r) {}

  GLINT_HD const HistogramSat& sat() const { return sat_; }
  GLINT_HD const SphericalBins& bins() const { return bins_; }
  /// Number of bins that occur in the map.
  GLINT_HD int binCount() const { return sat_.bin_count; }
  /// Mean normal of the texels of a bin over the whole map: the direction that stands for it.
  GLINT_HD Vec2 binNormal(int bin) const { return sat_.bin_normals.data()[bin]; }
  /// Middle of a bin in elevation and azimuth: the direction that stands for it in the paper.
  GLINT_HD Vec2 binCentre(int bin) const { return bins_.centre(sat_.bin_ids.data()[bin]); }

  /// Whole histogram of a footprint: visitor(int bin, float weight) for every bin with weight > 0, in increasing order,
  /// 0 <= bin < binCount(). Weights are shares of the footprint and sum to 1.
  template <class Visitor>
  GLINT_HD void forEachBin(const Footprint& p, Visitor&& visitor) const {
    BinCounts counts;
    const double scale = 1 / histogram(p, counts);
    for (int bin = 0; bin < sat_.bin_count; ++bin)
      if (counts.totals[bin] > 0) visitor(bin, static_cast<float>(scale * counts.totals[bin]));
  }

  /// Number of texels of each bin in [x0, x1) x [y0, y1) of the endless plane, exact for sides of up to 64 periods:
  /// visitor(int bin, int64 count) for every bin that occurs there.
  template <class Visitor>
  GLINT_HD void countTexels(std::int64_t x0, std::int64_t y0, std::int64_t x1, std::int64_t y1, Visitor&& visitor) const {
    BinCounts counts;
    AllBins sum(sat_, counts);
    RectangleSums<AllBins>(sat_, sum).add(static_cast<double>(x0), static_cast<double>(x1), static_cast<double>(y0),
                                          static_cast<double>(y1), 1);
    sum.finish();
    for (int bin = 0; bin < sat_.bin_count; ++bin)
      if (counts.totals[bin] > 0) visitor(bin, static_cast<std::int64_t>(counts.totals[bin]));
  }

  /// Density towards h, >= 0; 0 outside the unit disk. Even bins: the share of its bin over the bin's area, from the counters of one
  /// bin. Lobes: O(bins).
  GLINT_HD float density(const Footprint& p, Vec2 h) const {
    if (!(dot(h, h) <= 1)) return 0;
    if (shape_ == HistogramBins::lobes) {
      BinCounts counts;
      const double total = histogram(p, counts);
      return mixedDensity(counts, total, h);
    }
    const int id = bins_.find(h), bin = binOf(id);
    if (bin < 0) return 0;
    OneBin sum(sat_, bin);
    const double area = addFootprint(p, sum);
    return static_cast<float>(sum.count() / (area * bins_.area(id)));
  }

  /// Average density over a box of half vectors, the average of `density`: exact with even bins, to 1e-3 with lobes (SlopeLobe::mass);
  /// 0 if the box is empty.
  GLINT_HD float mean(const Footprint& p, const Box2& range) const {
    const Box2 box = insideSquare(range);
    if (!(box.width() > 0 && box.height() > 0)) return 0;
    BinCounts counts;
    const double total = histogram(p, counts);
    double mass = 0;
    for (int bin = 0; bin < sat_.bin_count; ++bin) {
      if (counts.totals[bin] <= 0) continue;
      if (hasLobe(bin)) {
        mass += counts.totals[bin] * double{lobe(bin).mass(box)};
        continue;
      }
      const int id = sat_.bin_ids.data()[bin];
      mass += counts.totals[bin] * (bins_.areaInside(id, box) / bins_.area(id));
    }
    return static_cast<float>(mass / (total * double{range.area()}));
  }

  /// Half vector with probability density `density`, which is its pdf. xi.x chooses the bin; what is left of it and xi.y choose the
  /// azimuth and the radius in the bin, or the slopes of its lobe, so that even xi stay even within bins.
  GLINT_HD HalfVectorSample sample(const Footprint& p, Vec2 xi) const {
    xi = clampUnit(xi);
    BinCounts counts;
    const double area = histogram(p, counts);
    double total = 0;
    for (int bin = 0; bin < sat_.bin_count; ++bin) total += counts.totals[bin];
    if (!(total > 0)) return {};
    double rest = total * static_cast<double>(xi.x);
    int chosen = -1;
    for (int bin = 0; bin < sat_.bin_count; ++bin) {
      if (counts.totals[bin] <= 0) continue;
      if (chosen >= 0) rest -= counts.totals[chosen];
      chosen = bin;
      if (rest < counts.totals[bin]) break;
    }
    const int id = sat_.bin_ids.data()[chosen];
    const auto within = clampUnit(static_cast<float>(rest / counts.totals[chosen]));
    if (shape_ == HistogramBins::lobes) {
      const HalfVectorSample drawn =
          hasLobe(chosen) ? lobe(chosen).sample({within, xi.y}) : HalfVectorSample{bins_.point(id, {within, xi.y}), 1};
      return drawn.pdf > 0 ? drawnAt(drawn.h, mixedDensity(counts, area, drawn.h)) : HalfVectorSample{};
    }
    return {bins_.point(id, {within, xi.y}), static_cast<float>(counts.totals[chosen] / (total * bins_.area(id)))};
  }

 private:
  GLINT_HD SlopeLobe lobe(int bin) const { return {sat_.bin_slopes.data()[bin], sigma_r_}; }
  /// Whether a bin is drawn as a lobe: not in the outermost ring.
  GLINT_HD bool hasLobe(int bin) const {
    return shape_ == HistogramBins::lobes && sat_.bin_ids.data()[bin] < (sat_.theta_bins - 1) * sat_.phi_bins;
  }
  /// Density of lobes and of even bins together.
  GLINT_HD float mixedDensity(const BinCounts& counts, double total, Vec2 h) const {
    const int id = bins_.find(h);
    double sum = 0;
    for (int bin = 0; bin < sat_.bin_count; ++bin) {
      if (counts.totals[bin] <= 0) continue;
      if (hasLobe(bin))
        sum += counts.totals[bin] * double{lobe(bin).density(h)};
      else if (sat_.bin_ids.data()[bin] == id)
        sum += counts.totals[bin] / bins_.area(id);
    }
    return finitePositive(static_cast<float>(sum / total));
  }

  /// Sums the texels of all bins. Returns the total: the area that was counted, texels^2.
  GLINT_HD double histogram(const Footprint& p, BinCounts& counts) const {
    AllBins sum(sat_, counts);
    const double area = addFootprint(p, sum);
    sum.finish();
    return area;
  }

  /// Number of a bin among the bins that occur, or -1.
  GLINT_HD int binOf(int id) const {
    const std::uint16_t* ids = sat_.bin_ids.data();
    const std::uint16_t* found = std::lower_bound(ids, ids + sat_.bin_count, id);
    return found != ids + sat_.bin_count && *found == id ? static_cast<int>(found - ids) : -1;
  }

  /// Adds the texels of a footprint. Returns the area that was added.
  template <class Sum>
  GLINT_HD double addFootprint(const Footprint& p, Sum& sum) const {
    if (p.kind == Footprint::Kind::box) {
      const double area = addBox(p, sum);
      if (area > 0) return area;
    }
    // The parallelogram of the same covariance with two upright sides, from Cholesky's factor.
    const UsableCovariance c = positiveCovariance(p.covariance);
    const double across = std::sqrt(c.xx);
    const AxisPair sigma = {{across, c.xy / across}, {0, std::sqrt(c.determinant()) / across}};
    if (gaussian_ == GaussianBoxes::one) return addParallelogram(p.centre, woundBox(sigma, sat_.width, sat_.height), 1, sum);
    // Three nested boxes for a Gaussian: sizes relative to the box of its covariance, and shares. They have the least squared
    // difference from the Gaussian for which the shares, and the shares times scales^2, sum to 1.
    constexpr double scales[3] = {0.508447702070, 0.812387977981, 1.239504002977};
    constexpr double shares[3] = {0.179460940730, 0.350350560935, 0.470188498334};
    double total = 0;
    for (int k = 0; k < 3; ++k) {
      const AxisPair half = woundBox(sigma.scaled(scales[k], scales[k]), sat_.width, sat_.height);
      total += addParallelogram(p.centre, half, shares[k] / (4 * std::fabs(half.cross())), sum);
    }
    return total;
  }

  /// Adds a box. Returns its area, or 0 if the box has no area or no finite size.
  template <class Sum>
  GLINT_HD double addBox(const Footprint& p, Sum& sum) const {
    AxisPair half = halfAxes(p);
    if (!hasArea(half)) return 0;
    const bool aligned = (half.a[1] == 0 && half.b[0] == 0) || (half.a[0] == 0 && half.b[1] == 0);
    if (!aligned) return addParallelogram(p.centre, shortenedBox(half, sat_.width, sat_.height), 1, sum);
    // Longer boxes are cut at kMostPeriods: more periods would change the histogram too little for their cost.
    const double most[2] = {kMostPeriods * sat_.width, kMostPeriods * sat_.height};
    for (double* axis : {half.a, half.b})
      for (int k = 0; k < 2; ++k) axis[k] = std::clamp(axis[k], -most[k], most[k]);
    return addParallelogram(p.centre, half, 1, sum);
  }

  /// Adds a parallelogram. Returns its area times the weight.
  template <class Sum>
  GLINT_DEVICE_CALL GLINT_HD double addParallelogram(Vec2 centre_uv, const AxisPair& half, double weight, Sum& sum) const {
    const double ax = half.a[0], ay = half.a[1], bx = half.b[0], by = half.b[1];
    const double x = double{wrapUnit(centre_uv.x)} * sat_.width, y = double{wrapUnit(centre_uv.y)} * sat_.height;
    if ((ay == 0 && bx == 0) || (ax == 0 && by == 0)) {
      const double rx = std::fabs(ax) + std::fabs(bx), ry = std::fabs(ay) + std::fabs(by);
      RectangleSums<Sum>(sat_, sum).add(x - rx, x + rx, y - ry, y + ry, weight);
      return weight * 4 * rx * ry;
    }
    const ParallelogramEdges edges(x, y, ax, ay, bx, by);
    const StripPlan plan = planStrips(sat_, ax, ay, bx, by, slant_tolerance_);
    if (plan.rows > 0) return weight * ParallelogramStrips<Sum>(sat_, sum, plan).add(edges, weight);
    ParallelogramSums<Sum>(sat_, sum).add(edges, weight);
    return weight * 4 * std::fabs(ax * by - ay * bx);
  }

  /// Longest half axis, in periods of the map, for which sums of areas stay below 2^63.
  static constexpr double kMostPeriods = 64;

  HistogramSat sat_;
  SphericalBins bins_;
  GaussianBoxes gaussian_;
  float slant_tolerance_;
  HistogramBins shape_;
  float sigma_r_;
};

static_assert(NdfModel<HistogramNdf>);

}  // namespace glint
