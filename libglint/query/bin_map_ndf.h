#pragma once

#include <algorithm>
#include <cmath>
#include <cstdint>

#include "glint/query/bin_lists.h"
#include "glint/query/facet_lobe.h"
#include "glint/query/gaussian.h"
#include "glint/query/half.h"
#include "glint/query/ndf_model.h"
#include "glint/query/sampling.h"

namespace glint {

/// Weights of the bins around a half vector: the share of a footprint whose normals are in each (Atanasov 2021, section 5.2).
struct BinWeights {
  static constexpr int kMost = 21;  ///< 5 x 5 without the corners

  int count = 0;
  std::uint32_t bins[kMost];  ///< numbers; only occupied bins, and only those of the square [-1, 1]^2
  double weights[kMost];      ///< 0 to 1
};

/// A facet, or several that are answered as one.
struct BinFacet {
  double weight = 0;  ///< share of the footprint
  Vec2 normal;
  Covariance spread;  ///< of the normals that it stands for, squared disk units; 0 for a single texel
};

/// The NDF from an inverse bin map (Atanasov 2021): exact shares of the footprint for every texel near the half vector.
///
/// Each texel in reach counts with its own normal, kept to 2^-place_bits of a bin. A bin that holds more than a few hundred texels of the
/// footprint counts as one Gaussian with the mean and covariance of its normals; between kFewTexels and kManyTexels the two are
/// blended, so that the density is continuous in footprint and half vector. Lobes are those of FacetLobe.
///
/// Boxes are answered exactly, Gaussians by the box of the same second moments: see TexelCover, also for boxes without area and
/// boxes larger than the map. Thread-safe, allocates nothing; the arrays must outlive it.
class BinMapNdf {
 public:
  /// Bins with fewer texels than this in the footprint are summed texel by texel, those with more than kManyTexels at once.
  static constexpr double kFewTexels = 256;
  static constexpr double kManyTexels = 512;
  /// A bin's Gaussian is wider than a facet's lobe: bins this far from the half vector are asked, in deviations.
  static constexpr float kBinReach = 5.5f;

  /// Of the smallest roughness that the map is made for.
  GLINT_HD explicit BinMapNdf(const BinMap& map) : BinMapNdf(map, map.alpha_min) {}
  /// @param alpha  Beckmann roughness of the facets, alpha_min to alpha_max of the map
  GLINT_HD BinMapNdf(const BinMap& map, float alpha) : lists_(map), sigma_(alpha * kInvSqrt2) {
    bin_size_ = 2.0f / static_cast<float>(map.bins_per_axis);
    one_bin_classes_ = map.classCount() == map.occupiedBins();
    const double wider = double{alpha} / map.alpha;
    merging_ = wider >= kNarrowestMerged ? std::max(1.0, wider * wider) : 0;
  }

  GLINT_HD const BinMap& map() const { return lists_.map(); }
  /// Deviation of a facet's lobe, disk units.
  GLINT_HD float sigma() const { return sigma_; }

  /// Density towards h, per unit projected area; >= 0.
  GLINT_HD float density(const Footprint& p, Vec2 h) const {
    if (!(std::fabs(h.x) <= 1 && std::fabs(h.y) <= 1)) return 0;
    double sum = 0;
    forEachFacet(p, {h, h}, [&](const BinFacet& f) { sum += f.weight * lobe(f, h); });
    return static_cast<float>(sum);
  }

  /// Average density over a box of half vectors; 0 if the box is empty. O(bins that the box reaches and their texels).
  GLINT_HD float mean(const Footprint& p, const Box2& range) const {
    const Box2 box = {{std::max(range.low.x, -1.0f), std::max(range.low.y, -1.0f)},
                      {std::min(range.high.x, 1.0f), std::min(range.high.y, 1.0f)}};
    if (!(box.width() > 0 && box.height() > 0)) return 0;
    double sum = 0;
    forEachFacet(p, box, [&](const BinFacet& f) { sum += f.weight * mass(f, box); });
    return static_cast<float>(sum / range.area());
  }

  /// A half vector with the density of the footprint (Atanasov 2021, section 5.3 and Eq. 18): a point of the footprint, the normal
  /// of its texel, and a point of its lobe. The leading digits of xi choose the point, the others the lobe.
  GLINT_HD HalfVectorSample sample(const Footprint& p, Vec2 xi) const {
    Vec2 normal;
    if (!sampleNormal(p, xi, normal)) return {};
    const float radius = sigma_ * FacetLobe::radius(xi.x), angle = 2 * kPi * xi.y;
    const Vec2 h = normal + radius * Vec2{std::cos(angle), std::sin(angle)};
    return {h, density(p, h)};
  }

  /// The normal of the texel at a point of the footprint, even over it. Uses up the leading digits of xi and leaves the others, even
  /// in [0, 1)^2.
  GLINT_HD bool sampleNormal(const Footprint& p, Vec2& xi, Vec2& normal) const {
    xi = clampUnit(xi);
    const TexelCover cover(p, map().width, map().height);
    double x = 0, y = 0;
    cover.point(xi.x, xi.y, x, y);
    xi = {fraction(xi.x * kStrata), fraction(xi.y * kStrata)};
    return normalAt(cover, x, y, normal);
  }

  /// Weights of the bins around h, exact to rounding. O(texels of the footprint) or less, whichever way is shorter.
  GLINT_HD BinWeights weights(const Footprint& p, Vec2 h) const {
    BinWeights result;
    RowWindow rows[5];
    const TexelCover cover(p, map().width, map().height);
    prefetchClasses(cover);
    const int row_count = windowAround(h, rows);
    const double scale = 1 / cover.area();
    if (shorterByTexel(cover, rows, row_count)) {
      weighByTexel(cover, rows, row_count, result);
    } else {
      weighByList(cover, rows, row_count, result);
    }
    for (int k = 0; k < result.count; ++k) result.weights[k] *= scale;
    return result;
  }

  /// Visits what of a footprint has normals in reach of a box of half vectors: visitor(BinFacet). Weights are shares of the
  /// footprint; those of normals out of reach are missing.
  template <class Visitor>
  GLINT_HD void forEachFacet(const Footprint& p, const Box2& support, Visitor&& visitor) const {
    const TexelCover cover(p, map().width, map().height);
    const BinReach reach = reachOf(support);
    if (cover.area() <= kFewTexels && boxTexels(cover) <= 2 * kFewTexels) {
      forEachFacetByTexel(cover, reach, visitor);
      return;
    }
    for (int row = reach.row_begin; row < reach.row_end; ++row) {
      std::uint32_t first, end;
      binsInReach(reach, row, first, end);
      lists_.forEachOccupied(
          first, end, [&](std::uint32_t bin, std::uint32_t ordinal) { visitBin(cover, lists_.list(bin, ordinal), visitor); });
    }
  }

 private:
  /// Occupied bins of one row of the window around a half vector.
  struct RowWindow {
    std::uint32_t bins[5];
    std::uint32_t ordinal = 0;  // of the first
    int count = 0;
    int slot = 0;  // of the first among those of all rows
  };

  static constexpr float kStrata = 4096;
  /// Bins count as one facet for lobes that are not much narrower than those that they were made for.
  static constexpr double kNarrowestMerged = 0.9;

  /// The bins that a box of half vectors reaches.
  struct BinReach {
    Box2 support;
    float radius;
    int row_begin, row_end;
  };

  GLINT_HD BinReach reachOf(const Box2& support) const {
    const float radius = kBinReach * sigma_;
    return {support, radius, binAt(support.low.y - radius), binAt(support.high.y + radius) + 1};
  }

  /// Bins [first, end) of a row: above and below the box its part in reach is shorter.
  GLINT_HD void binsInReach(const BinReach& reach, int row, std::uint32_t& first, std::uint32_t& end) const {
    const float low = -1 + static_cast<float>(row) * bin_size_;
    const float gap = std::max({low - reach.support.high.y, reach.support.low.y - low - bin_size_, 0.0f});
    const float half = std::sqrt(std::max(0.0f, reach.radius * reach.radius - gap * gap));
    const std::uint32_t row_start = static_cast<std::uint32_t>(row) * static_cast<std::uint32_t>(map().bins_per_axis);
    first = row_start + static_cast<std::uint32_t>(binAt(reach.support.low.x - half));
    end = row_start + static_cast<std::uint32_t>(binAt(reach.support.high.x + half)) + 1;
  }

  /// Texels of a footprint's bounding box: more than an int may hold.
  static GLINT_HD double boxTexels(const TexelCover& cover) { return 1.0 * cover.columns() * cover.rows(); }

  /// Texels of one row of a footprint's bounding box: (x, y) in its coordinates is (column, row) of the map.
  struct TexelRow {
    int x, y, column, row, count;
  };

  /// Calls visitor(TexelRow) for all texels of a footprint's bounding box, at most kMostAtOnce together.
  template <class Visitor>
  GLINT_HD void forEachTexelRow(const TexelCover& cover, Visitor&& visitor) const {
    for (int y = 0, j = cover.originY(); y < cover.rows(); ++y, j = j + 1 < map().height ? j + 1 : 0) {
      for (int x = 0, i = cover.originX(); x < cover.columns();) {
        const int count = std::min({cover.columns() - x, map().width - i, BinLists::kMostAtOnce});
        visitor(TexelRow{x, y, i, j, count});
        x += count;
        i = i + count < map().width ? i + count : 0;
      }
    }
  }

  /// Asks for the classes of a small footprint, whose rows are far apart in memory.
  GLINT_HD void prefetchClasses(const TexelCover& cover) const {
    constexpr int kMostRows = 40;
    if (cover.rows() > kMostRows) return;
    const int last = std::min(cover.originX() + cover.columns(), map().width) - 1;
    for (int y = 0, j = cover.originY(); y < cover.rows(); ++y, j = j + 1 < map().height ? j + 1 : 0) {
      const std::uint64_t row = static_cast<std::uint64_t>(j) * static_cast<std::uint64_t>(map().width);
      lists_.prefetchClass(row + static_cast<std::uint64_t>(cover.originX()));
      lists_.prefetchClass(row + static_cast<std::uint64_t>(last));
    }
  }

  GLINT_HD std::uint64_t indexOf(const TexelRow& row) const {
    return static_cast<std::uint64_t>(row.row) * static_cast<std::uint64_t>(map().width) +
           static_cast<std::uint64_t>(row.column);
  }

  /// Calls visitor(x, y, column, row, class) for the texels of a footprint's bounding box whose class is in [first, last].
  template <class Visitor>
  GLINT_HD void forEachTexelOfClasses(const TexelCover& cover, std::uint32_t first, std::uint32_t last,
                                      Visitor&& visitor) const {
    forEachTexelRow(cover, [&](const TexelRow& row) {
      for (std::uint64_t bits = lists_.texelsOfClasses(indexOf(row), row.count, first, last); bits != 0; bits &= bits - 1) {
        const int k = lowestBit(bits);
        visitor(row.x + k, row.y, static_cast<std::uint32_t>(row.column + k), static_cast<std::uint32_t>(row.row),
                lists_.texelClass(indexOf(row) + static_cast<std::uint64_t>(k)));
      }
    });
  }

  /// For footprints of few texels, which none of the bins would be merged for: looks up every texel.
  template <class Visitor>
  GLINT_HD void forEachFacetByTexel(const TexelCover& cover, const BinReach& reach, Visitor& visitor) const {
    prefetchClasses(cover);
    const double scale = 1 / cover.area();
    const auto bins = static_cast<std::uint32_t>(map().bins_per_axis);
    const std::uint32_t first_class = lists_.classOf(static_cast<std::uint32_t>(reach.row_begin) * bins);
    const std::uint32_t last_class = lists_.classOf(static_cast<std::uint32_t>(reach.row_end) * bins - 1);
    forEachTexelOfClasses(cover, first_class, last_class, [&](int x, int y, std::uint32_t i, std::uint32_t j, std::uint32_t c) {
      const std::uint32_t class_begin = map().class_bins.data()[c], class_end = map().class_bins.data()[c + 1];
      BinTexel found;
      std::uint32_t first, end;
      const int row_begin = std::max(static_cast<int>(class_begin / bins), reach.row_begin);
      const int row_end = std::min(static_cast<int>((class_end - 1) / bins) + 1, reach.row_end);
      for (int row = row_begin; row < row_end; ++row) {
        binsInReach(reach, row, first, end);
        first = std::max(first, class_begin), end = std::min(end, class_end);
        if (first >= end || !lists_.find(first, end, i, j, found)) continue;
        const double weight = cover.texel(x, y);
        if (weight > 0) visitor(BinFacet{scale * weight, normal(corner(found.bin), found.code), {}});
        return;
      }
    });
  }

  static GLINT_HD float fraction(float x) { return x - std::floor(x); }

  /// Row or column of bins at a coordinate, those outside the square moved to its border.
  GLINT_HD int binAt(float x) const {
    const auto last = static_cast<float>(map().bins_per_axis - 1);
    return static_cast<int>(std::clamp((x + 1) * 0.5f * static_cast<float>(map().bins_per_axis), 0.0f, last));
  }

  /// The rows of the window; false bins, beyond the square, are left out.
  GLINT_HD int windowAround(Vec2 h, RowWindow* rows) const {
    if (!(std::fabs(h.x) <= 1 && std::fabs(h.y) <= 1)) return 0;
    const int bins = map().bins_per_axis, column = binAt(h.x), row = binAt(h.y);
    int count = 0, slot = 0;
    for (int dy = -2; dy <= 2; ++dy) {
      const int reach = dy == -2 || dy == 2 ? 1 : 2;
      if (row + dy < 0 || row + dy >= bins) continue;
      const auto first = static_cast<std::uint32_t>(row + dy) * static_cast<std::uint32_t>(bins);
      RowWindow& out = rows[count++];
      out.slot = slot;
      out.count = 0;
      lists_.forEachOccupied(first + static_cast<std::uint32_t>(std::max(column - reach, 0)),
                             first + static_cast<std::uint32_t>(std::min(column + reach, bins - 1)) + 1,
                             [&](std::uint32_t bin, std::uint32_t ordinal) {
                               if (out.count == 0) out.ordinal = ordinal;
                               out.bins[out.count++] = bin;
                             });
      slot += out.count;
    }
    return count;
  }

  /// Whether looking up every texel of the footprint is cheaper than reading lists.
  GLINT_HD bool shorterByTexel(const TexelCover& cover, const RowWindow* rows, int row_count) const {
    // Nanoseconds, about. Texels of the window cost more where each is a branch: few of them are where classes have many bins.
    constexpr double kTexelCost = 1, kBranchCost = 6, kListCost = 0.6, kBinCost = 60, kCellRowCost = 60;
    const double branch_cost = one_bin_classes_ && !cover.aligned() ? kBranchCost : 0;
    double texels = 0;
    int bins = 0;
    for (int r = 0; r < row_count; ++r) bins += rows[r].count;
    if ((kTexelCost + branch_cost) * boxTexels(cover) < kBinCost * bins) return true;
    for (int r = 0; r < row_count; ++r) {
      if (rows[r].count == 0) continue;
      texels += static_cast<double>(map().bin_starts[rows[r].ordinal + static_cast<std::uint32_t>(rows[r].count)] -
                                    map().bin_starts[rows[r].ordinal]);
    }
    // Lists are read up to a cell around the border; a cell of a bin holds 1 to 2 leaves.
    const double all = static_cast<double>(map().texels.size());
    const double cell = std::sqrt(all * 1.5 * map().leaf_size * bins / std::max(texels, 1.0));
    const double border = 2 * (cover.columns() + cover.rows()) * cell + 2 * cell * cell;
    const double by_list =
        kListCost * texels / all * std::min(all, border) + (kBinCost + kCellRowCost * cover.rows() / cell) * bins;
    return (kTexelCost + branch_cost * texels / all) * boxTexels(cover) < by_list;
  }

  GLINT_HD void weighByTexel(const TexelCover& cover, const RowWindow* rows, int row_count, BinWeights& result) const {
    for (int r = 0; r < row_count; ++r) {
      for (int k = 0; k < rows[r].count; ++k) {
        result.bins[rows[r].slot + k] = rows[r].bins[k];
        result.weights[rows[r].slot + k] = 0;
      }
      result.count += rows[r].count;
    }
    constexpr int kWorthATable = 64;  // texels
    if (one_bin_classes_ && cover.aligned() && boxTexels(cover) > kWorthATable)
      weighByBinClass(cover, rows, row_count, result);
    else
      weighByClass(cover, rows, row_count, result);
  }

  /// Looks at the class of every texel and, for the few of classes around the window, where they are in it.
  GLINT_HD void weighByClass(const TexelCover& cover, const RowWindow* rows, int row_count, BinWeights& result) const {
    if (result.count == 0) return;
    const std::uint32_t first = lists_.classOf(result.bins[0]), last = lists_.classOf(result.bins[result.count - 1]);
    forEachTexelOfClasses(cover, first, last, [&](int x, int y, std::uint32_t i, std::uint32_t j, std::uint32_t c) {
      const std::uint32_t class_begin = map().class_bins.data()[c], class_end = map().class_bins.data()[c + 1];
      for (int r = 0; r < row_count; ++r) {
        const RowWindow& row = rows[r];
        if (row.count == 0) continue;
        const std::uint32_t begin = std::max(row.bins[0], class_begin), end = std::min(row.bins[row.count - 1] + 1, class_end);
        BinTexel found;
        if (begin >= end || !(one_bin_classes_ || lists_.find(begin, end, i, j, found))) continue;
        const std::uint32_t ordinal = one_bin_classes_ ? c : found.ordinal;
        result.weights[static_cast<std::uint32_t>(row.slot) + ordinal - row.ordinal] += cover.texel(x, y);
        return;
      }
    });
  }

  /// The same where every class is a bin, for boxes along the axes: each texel is counted, without branches, in the slot of its bin;
  /// one more slot takes those that are not in the window.
  GLINT_HD void weighByBinClass(const TexelCover& cover, const RowWindow* rows, int row_count, BinWeights& result) const {
    std::uint8_t slots[BinMap::kMaxClasses];
    std::fill(slots, slots + map().classCount(), static_cast<std::uint8_t>(BinWeights::kMost));
    for (int r = 0; r < row_count; ++r)
      for (int k = 0; k < rows[r].count; ++k)
        slots[rows[r].ordinal + static_cast<std::uint32_t>(k)] = static_cast<std::uint8_t>(rows[r].slot + k);
    // Counts of four texels in turn, since an increment waits for the last one of the same slot; flushed where a row's height changes.
    constexpr int kSlots = BinWeights::kMost + 1;
    std::uint32_t counts[4][kSlots] = {};
    const BoxSides sides(cover);
    int last_y = 0;
    const auto flush = [&](double height) {
      for (int slot = 0; slot < result.count; ++slot) {
        result.weights[slot] += height * (1.0 * counts[0][slot] + counts[1][slot] + counts[2][slot] + counts[3][slot]);
        counts[0][slot] = counts[1][slot] = counts[2][slot] = counts[3][slot] = 0;
      }
    };
    const auto height = [&](int y) { return y == 0 ? sides.lower : y == sides.last_y ? sides.upper : 1.0f; };
    forEachTexelRow(cover, [&](TexelRow row) {
      if (height(row.y) != height(last_y)) flush(height(last_y));
      last_y = row.y;
      const auto edge = [&](std::uint64_t index, float width) {
        if (const int slot = slots[lists_.texelClass(index)]; slot < BinWeights::kMost)
          result.weights[slot] += double{width} * height(row.y);
      };
      if (row.x == 0) {
        edge(indexOf(row), sides.left);
        ++row.column, ++row.x, --row.count;
      }
      if (row.count > 0 && row.x + row.count - 1 == sides.last_x) {
        edge(indexOf(row) + static_cast<std::uint64_t>(row.count) - 1, sides.right);
        --row.count;
      }
      lists_.forEachClass(
          indexOf(row), row.count, [&](int, std::uint32_t c) { ++counts[0][slots[c]]; },
          [&](int, std::uint32_t c0, std::uint32_t c1, std::uint32_t c2, std::uint32_t c3) {
            ++counts[0][slots[c0]], ++counts[1][slots[c1]], ++counts[2][slots[c2]], ++counts[3][slots[c3]];
          });
    });
    flush(height(last_y));
  }

  /// Everything is asked for before it is read: the processor then waits for all bins together, not for one after the other.
  GLINT_HD void weighByList(const TexelCover& cover, const RowWindow* rows, int row_count, BinWeights& result) const {
    BinList lists[BinWeights::kMost];
    CellRows cell_rows;
    AreaSum sum(*this, cover);
    const bool rare = cover.fits() && kBlock * cover.area() < 0.5 * static_cast<double>(map().texels.size());
    int grids[BinWeights::kMost], grid_count = 0;
    for (int r = 0; r < row_count; ++r) {
      const RowWindow& row = rows[r];
      for (int k = 0; k < row.count; ++k) {
        result.bins[row.slot + k] = row.bins[k];
        result.weights[row.slot + k] = 0;
      }
      result.count += row.count;
      if (row.count == 0) continue;
      const bool joined = rare && lists_.gridless(row.ordinal, row.count);
      for (int k = 0; k < row.count; ++k) {
        const int slot = row.slot + k;
        lists[slot] = lists_.list(row.bins[k], row.ordinal + static_cast<std::uint32_t>(k));
        if (lists[slot].grid >= 0) {
          prefetch(map().grid_cells.data() + lists[slot].grid);
          grids[grid_count++] = slot;
        } else if (!joined) {
          sum.select(result.weights + slot);
          lists_.forEachWholeListRun(cover, lists[slot].begin, lists[slot].end, sum);
        }
      }
      if (joined) sum.addRow(lists + row.slot, row.count, result.weights + row.slot);
    }
    for (int k = 0; k < grid_count; ++k) lists_.prefetchCells(cover, lists[grids[k]], cell_rows);
    for (int k = 0; k < grid_count; ++k) {
      sum.select(result.weights + grids[k]);
      lists_.forEachRun(cover, lists[grids[k]], cell_rows, sum);
    }
    sum.flush();
  }

  /// What of its border texels a box along the axes covers.
  struct BoxSides {
    GLINT_HD explicit BoxSides(const TexelCover& cover)
        : last_x(cover.columns() - 1),
          last_y(cover.rows() - 1),
          left(static_cast<float>(cover.firstColumn())),
          right(static_cast<float>(cover.lastColumn())),
          lower(static_cast<float>(cover.firstRow())),
          upper(static_cast<float>(cover.lastRow())) {}
    int last_x, last_y;
    float left, right, lower, upper;
  };

  /// Adds up areas of runs, several at a time.
  class AreaSum {
   public:
    GLINT_HD AreaSum(const BinMapNdf& ndf, const TexelCover& cover) : ndf_(ndf), cover_(cover), sides_(cover) {}
    GLINT_HD void select(double* area) { area_ = area; }
    GLINT_HD void whole(std::uint64_t begin, std::uint64_t end) { *area_ += static_cast<double>(end - begin); }
    GLINT_HD void partial(const TexelRun& run) { push(run, area_, nullptr, run.rare ? 1 : 0); }
    /// Lists of neighbouring bins without grids, for footprints that few of their texels are in.
    GLINT_HD void addRow(const BinList* lists, int count, double* areas) {
      push({lists[0].begin, lists[count - 1].end, cover_.originX(), cover_.originY(), cover_.width(), cover_.height()}, areas,
           lists, count);
    }
    GLINT_HD void flush() {
      for (int k = 0; k < count_; ++k) {
        const Item& item = items_[k];
        if (item.count > 0)
          ndf_.addRareTexels(cover_, item.run, item.lists, item.count, item.areas);
        else
          *item.areas += cover_.aligned() ? ndf_.alignedArea(sides_, item.run) : ndf_.turnedArea(cover_, item.run);
      }
      count_ = 0;
    }

   private:
    struct Item {
      TexelRun run;
      double* areas;
      const BinList* lists;
      int count;
    };
    static constexpr int kMost = 32;

    GLINT_HD void push(const TexelRun& run, double* areas, const BinList* lists, int count) {
      constexpr std::uint64_t kLine = 16, kAhead = 16 * kLine;  // texels
      const std::uint32_t* texels = ndf_.map().texels.data();
      for (std::uint64_t k = run.begin; k < std::min(run.end, run.begin + kAhead); k += kLine) prefetch(texels + k);
      prefetch(texels + run.end - 1);
      items_[count_++] = {run, areas, lists, count};
      if (count_ == kMost) flush();
    }

    const BinMapNdf& ndf_;
    const TexelCover& cover_;
    BoxSides sides_;
    double* area_ = nullptr;
    int count_ = 0;
    Item items_[kMost];
  };

  static constexpr int kBlock = 16;

  /// Looks for the few texels of a row of lists (or of one, which needs no `lists`) that are in a footprint: blocks in which none is
  /// are left without branches.
  GLINT_HD void addRareTexels(const TexelCover& cover, const TexelRun& run, const BinList* lists, int count,
                              double* areas) const {
    const TexelCode code = lists_.code();
    const auto columns = static_cast<std::uint32_t>(cover.columns()), rows = static_cast<std::uint32_t>(cover.rows());
    const std::uint32_t* texels = map().texels.data();
    int slot = 0;
    for (std::uint64_t begin = run.begin; begin < run.end; begin += kBlock) {
      const TexelRun block = {begin, std::min(begin + kBlock, run.end), run.offset_x, run.offset_y, run.wrap_x, run.wrap_y};
      const int size = static_cast<int>(block.end - begin);
      std::uint32_t hits = 0;
      for (int k = 0; k < size; ++k) {
        int x = static_cast<int>(code.column(texels[begin + k])) - run.offset_x;
        int y = static_cast<int>(code.row(texels[begin + k])) - run.offset_y;
        x += (x >> 31) & run.wrap_x;
        y += (y >> 31) & run.wrap_y;
        hits |= static_cast<std::uint32_t>(static_cast<std::uint32_t>(x) < columns) &
                static_cast<std::uint32_t>(static_cast<std::uint32_t>(y) < rows);
      }
      if (hits == 0) continue;
      forEachTexel(cover, block, [&](double weight, std::uint32_t, std::uint64_t k) {
        while (slot + 1 < count && k >= lists[slot].end) ++slot;
        areas[slot] += weight;
      });
    }
  }

  /// Area of a list's texels in a footprint, texels.
  GLINT_HD double coveredArea(const TexelCover& cover, const BinList& list) const {
    double area = 0;
    AreaSum sum(*this, cover);
    CellRows rows;
    sum.select(&area);
    lists_.forEachRun(cover, list, rows, sum);
    sum.flush();
    return area;
  }

  /// Area of a run's texels in a box along the axes: loops without branches, which compilers vectorise.
  GLINT_HD double alignedArea(const BoxSides& sides, const TexelRun& run) const {
    const TexelCode code = lists_.code();
    if (run.inside_x)
      return stripArea(run, code.column_bits, code.row_bits, run.offset_y, sides.last_y, sides.lower, sides.upper);
    if (run.inside_y) return stripArea(run, 0, code.column_bits, run.offset_x, sides.last_x, sides.left, sides.right);
    const auto side = [](int x, int last, float first_part, float last_part) {
      const float inner = static_cast<unsigned>(x) <= static_cast<unsigned>(last) ? 1.0f : 0.0f;
      const float end = x == last ? last_part : inner;
      return x == 0 ? first_part : end;
    };
    float areas[kBlock];
    double total = 0;
    for (std::uint64_t begin = run.begin; begin < run.end; begin += kBlock) {
      const std::uint32_t* texels = map().texels.data() + begin;
      const int count = static_cast<int>(std::min<std::uint64_t>(kBlock, run.end - begin));
      for (int k = 0; k < count; ++k) {
        int x = static_cast<int>(code.column(texels[k])) - run.offset_x,
            y = static_cast<int>(code.row(texels[k])) - run.offset_y;
        x += (x >> 31) & run.wrap_x;
        y += (y >> 31) & run.wrap_y;
        areas[k] = side(x, sides.last_x, sides.left, sides.right) * side(y, sides.last_y, sides.lower, sides.upper);
      }
      float sums[4] = {};
      int k = 0;
      for (; k + 4 <= count; k += 4)
        for (int lane = 0; lane < 4; ++lane) sums[lane] += areas[k + lane];
      for (; k < count; ++k) sums[0] += areas[k];
      total += (double{sums[0]} + sums[1]) + (double{sums[2]} + sums[3]);
    }
    return total;
  }

  /// Area of a run's texels that are cut along one axis only, by a footprint that covers `first_part` of the texels at 0 and
  /// `last_part` of those at `last`.
  GLINT_HD double stripArea(const TexelRun& run, int shift, int bits, int offset, int last, float first_part,
                            float last_part) const {
    const std::uint32_t* texels = map().texels.data();
    const auto mask = static_cast<int>((1u << bits) - 1);
    int inner = 0, at_first = 0, at_last = 0;
    for (std::uint64_t k = run.begin; k < run.end; ++k) {
      const int at = static_cast<int>(texels[k] >> shift) & mask;
      const int x = at - offset;
      inner += (x > 0) & (x < last);
      at_first += x == 0;
      at_last += x == last;
    }
    return inner + double{first_part} * at_first + (last > 0 ? double{last_part} * at_last : 0);
  }

  GLINT_HD double turnedArea(const TexelCover& cover, const TexelRun& run) const {
    double area = 0;
    forEachTexel(cover, run, [&](double weight, std::uint32_t, std::uint64_t) { area += weight; });
    return area;
  }

  /// Calls visitor(covered area, code, place in the list) for the texels of a run that are in a footprint.
  template <class Visitor>
  GLINT_HD void forEachTexel(const TexelCover& cover, const TexelRun& run, Visitor&& visitor) const {
    const TexelCode code = lists_.code();
    for (std::uint64_t k = run.begin; k < run.end; ++k) {
      const std::uint32_t texel = lists_.texel(k);
      int x = static_cast<int>(code.column(texel)) - run.offset_x, y = static_cast<int>(code.row(texel)) - run.offset_y;
      if (x < 0) x += run.wrap_x;
      if (y < 0) y += run.wrap_y;
      if (x < 0 || y < 0 || x >= cover.columns() || y >= cover.rows()) continue;
      const double weight = cover.texel(x, y);
      if (weight > 0) visitor(weight, texel, k);
    }
  }

  GLINT_HD Vec2 corner(std::uint32_t bin) const {
    const auto bins = static_cast<std::uint32_t>(map().bins_per_axis);
    return {-1 + static_cast<float>(bin % bins) * bin_size_, -1 + static_cast<float>(bin / bins) * bin_size_};
  }

  GLINT_HD Vec2 normal(Vec2 low, std::uint32_t texel) const {
    const TexelCode& code = lists_.code();
    const float step = bin_size_ / static_cast<float>(1 << code.place_bits);
    return low + step * Vec2{static_cast<float>(code.placeX(texel)) + 0.5f, static_cast<float>(code.placeY(texel)) + 0.5f};
  }

  /// How far a bin counts as one facet. Lobes that are wider than the bins were made for need fewer texels in them for the same error;
  /// footprints of few texels merge nothing, as when they are looked up texel by texel.
  GLINT_HD double mergedShare(const TexelCover& cover, const BinList& list) const {
    const double expected = static_cast<double>(list.size()) * cover.area() / static_cast<double>(map().texels.size());
    return std::clamp((std::min(merging_ * expected, cover.area()) - kFewTexels) / (kManyTexels - kFewTexels), 0.0, 1.0);
  }

  /// Passes on the facets of one bin.
  template <class Visitor>
  GLINT_HD void visitBin(const TexelCover& cover, const BinList& list, Visitor& visitor) const {
    const double merged = list.grid < 0 ? 0 : mergedShare(cover, list);
    if (merged < 1) {
      struct Each {
        const BinMapNdf& ndf;
        const TexelCover& cover;
        Vec2 low;
        double scale;
        Visitor& visitor;
        GLINT_HD void add(double weight, std::uint32_t texel) { visitor(BinFacet{scale * weight, ndf.normal(low, texel), {}}); }
        GLINT_HD void whole(std::uint64_t begin, std::uint64_t end) {
          for (std::uint64_t k = begin; k < end; ++k) add(1, ndf.lists_.texel(k));
        }
        GLINT_HD void partial(const TexelRun& run) {
          ndf.forEachTexel(cover, run, [&](double weight, std::uint32_t texel, std::uint64_t) { add(weight, texel); });
        }
      } each{*this, cover, corner(list.bin), (1 - merged) / cover.area(), visitor};
      CellRows rows;
      lists_.forEachRun(cover, list, rows, each);
    }
    if (merged > 0) {
      BinFacet facet = binFacet(list);
      facet.weight = merged * coveredArea(cover, list) / cover.area();
      visitor(facet);
    }
  }

  /// All texels of a bin with a grid as one facet.
  GLINT_HD BinFacet binFacet(const BinList& list) const {
    const std::uint16_t* moments = map().grid_moments.data() + 5 * list.grid;
    const float squared = bin_size_ * bin_size_;
    return {0,
            corner(list.bin) + bin_size_ * Vec2{halfToFloat(moments[0]), halfToFloat(moments[1])},
            {squared * halfToFloat(moments[2]), squared * halfToFloat(moments[3]), squared * halfToFloat(moments[4])}};
  }

  GLINT_HD double lobe(const BinFacet& f, Vec2 h) const {
    const float squared = sigma_ * sigma_;
    return FacetLobe::density({squared + f.spread.xx, f.spread.xy, squared + f.spread.yy}, h - f.normal);
  }

  /// Mass of a facet's lobe in a box, as of a whole Gaussian: within 1e-4 of that of the lobe.
  GLINT_HD double mass(const BinFacet& f, const Box2& box) const {
    return gaussianMass(box.low.x, box.high.x, f.normal.x, std::sqrt(sigma_ * sigma_ + f.spread.xx)) *
           gaussianMass(box.low.y, box.high.y, f.normal.y, std::sqrt(sigma_ * sigma_ + f.spread.yy));
  }

  /// Normal of the texel at a point in coordinates of the footprint.
  GLINT_HD bool normalAt(const TexelCover& cover, double x, double y, Vec2& found) const {
    const auto wrapped = [](int i, int n) { return (i % n + n) % n; };
    const auto i = static_cast<std::uint32_t>(wrapped(cover.originX() + static_cast<int>(std::floor(x)), map().width));
    const auto j = static_cast<std::uint32_t>(wrapped(cover.originY() + static_cast<int>(std::floor(y)), map().height));
    const std::uint32_t c = lists_.texelClass(static_cast<std::uint64_t>(j) * static_cast<std::uint64_t>(map().width) + i);
    BinTexel texel;
    if (!lists_.find(map().class_bins.data()[c], map().class_bins.data()[c + 1], i, j, texel)) return false;
    found = normal(corner(texel.bin), texel.code);
    return true;
  }

  BinLists lists_;
  float sigma_ = 0;
  float bin_size_ = 0;
  double merging_ = 1;  ///< texels that one in a bin counts as when deciding to merge; 0: never merged
  bool one_bin_classes_ = false;
};

static_assert(NdfModel<BinMapNdf>);

}  // namespace glint
