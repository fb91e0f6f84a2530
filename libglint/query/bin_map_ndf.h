#pragma once

#include <algorithm>
#include <cmath>
#include <cstdint>

#include "glint/query/bin_lists.h"
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
/// blended, so that the density is continuous in footprint and half vector. Lobes end at kBinLobeReach deviations, where they are 0.
///
/// Boxes are answered exactly, Gaussians by the box of the same second moments: see TexelCover, also for boxes without area and
/// boxes larger than the map. Thread-safe, allocates nothing; the arrays must outlive it.
class BinMapNdf {
 public:
  /// Bins with fewer texels than this in the footprint are summed texel by texel, those with more than kManyTexels at once.
  static constexpr double kFewTexels = 256;
  static constexpr double kManyTexels = 512;
  /// Radius of a facet's lobe in deviations.
  static constexpr float kBinLobeReach = 5;
  /// A bin's Gaussian is wider than a facet's lobe: bins this far from the half vector are asked, in deviations.
  static constexpr float kBinReach = 5.5f;

  GLINT_HD explicit BinMapNdf(const BinMap& map) : lists_(map), sigma_(map.alpha * kInvSqrt2) {
    bin_size_ = 2.0f / static_cast<float>(map.bins_per_axis);
    one_bin_classes_ = map.classCount() == map.occupiedBins();
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
    xi = clampUnit(xi);
    const TexelCover cover(p, map().width, map().height);
    double x = 0, y = 0;
    cover.point(xi.x, xi.y, x, y);
    Vec2 normal;
    if (!normalAt(cover, x, y, normal)) return {};
    const float u = fraction(xi.x * kStrata), angle = 2 * kPi * fraction(xi.y * kStrata);
    const float radius = sigma_ * lobeRadius(u);
    const Vec2 h = normal + radius * Vec2{std::cos(angle), std::sin(angle)};
    return {h, density(p, h)};
  }

  /// Weights of the bins around h, exact to rounding. O(texels of the footprint) or less, whichever way is shorter.
  GLINT_HD BinWeights weights(const Footprint& p, Vec2 h) const {
    BinWeights result;
    RowWindow rows[5];
    const int row_count = windowAround(h, rows);
    const TexelCover cover(p, map().width, map().height);
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
    const float reach = kBinReach * sigma_;
    const int row_begin = binAt(support.low.y - reach), row_end = binAt(support.high.y + reach) + 1;
    const auto bins = static_cast<std::uint32_t>(map().bins_per_axis);
    for (int row = row_begin; row < row_end; ++row) {
      // The part of the row in reach is shorter above and below the box.
      const float low = -1 + static_cast<float>(row) * bin_size_;
      const float gap = std::max({low - support.high.y, support.low.y - low - bin_size_, 0.0f});
      const float half = std::sqrt(std::max(0.0f, reach * reach - gap * gap));
      const std::uint32_t first = static_cast<std::uint32_t>(row) * bins;
      lists_.forEachOccupied(
          first + static_cast<std::uint32_t>(binAt(support.low.x - half)),
          first + static_cast<std::uint32_t>(binAt(support.high.x + half)) + 1,
          [&](std::uint32_t bin, std::uint32_t ordinal) { visitBin(cover, lists_.list(bin, ordinal), visitor); });
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
    if (!one_bin_classes_) return false;
    double texels = 0;
    int bins = 0;
    for (int r = 0; r < row_count; ++r) {
      if (rows[r].count == 0) continue;
      bins += rows[r].count;
      texels += static_cast<double>(map().bin_starts[rows[r].ordinal + static_cast<std::uint32_t>(rows[r].count)] -
                                    map().bin_starts[rows[r].ordinal]);
    }
    // Lists are read up to a cell around the border; a cell of a bin holds 1 to 2 leaves.
    const double all = static_cast<double>(map().texels.size());
    const double cell = std::sqrt(all * 1.5 * map().leaf_size * bins / std::max(texels, 1.0));
    const double border = 2 * (cover.columns() + cover.rows()) * cell + 2 * cell * cell;
    constexpr double kTexelCost = 5, kListCost = 0.8, kBinCost = 60;  // nanoseconds, about
    const double by_list = kListCost * texels / all * std::min(all, border) + kBinCost * bins;
    return kTexelCost * cover.columns() * cover.rows() < by_list;
  }

  /// Needs classes of one bin each: then a texel's class is the ordinal of its bin.
  GLINT_HD void weighByTexel(const TexelCover& cover, const RowWindow* rows, int row_count, BinWeights& result) const {
    constexpr std::uint8_t kNone = 255;
    std::uint8_t slots[BinMap::kMaxClasses];
    std::fill(slots, slots + map().classCount(), kNone);
    for (int r = 0; r < row_count; ++r) {
      for (int k = 0; k < rows[r].count; ++k) {
        const int slot = rows[r].slot + k;
        result.bins[slot] = rows[r].bins[k];
        result.weights[slot] = 0;
        slots[rows[r].ordinal + static_cast<std::uint32_t>(k)] = static_cast<std::uint8_t>(slot);
      }
      result.count += rows[r].count;
    }
    for (int y = 0, j = cover.originY(); y < cover.rows(); ++y, j = j + 1 < map().height ? j + 1 : 0) {
      const std::uint64_t row = static_cast<std::uint64_t>(j) * map().width;
      for (int x = 0, i = cover.originX(); x < cover.columns(); ++x, i = i + 1 < map().width ? i + 1 : 0) {
        const int slot = slots[lists_.texelClass(row + static_cast<std::uint64_t>(i))];
        if (slot != kNone) result.weights[slot] += cover.texel(x, y);
      }
    }
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
    GLINT_HD void partial(const TexelRun& run) { push(run, area_, nullptr, 0); }
    /// Lists of neighbouring bins without grids, for footprints that few of their texels are in.
    GLINT_HD void addRow(const BinList* lists, int count, double* areas) {
      push({lists[0].begin, lists[count - 1].end, cover_.originX(), cover_.originY(), cover_.width(), cover_.height()}, areas,
           lists, count);
    }
    GLINT_HD void flush() {
      for (int k = 0; k < count_; ++k) {
        const Item& item = items_[k];
        if (item.lists != nullptr)
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

  /// Looks for the few texels of a row of lists that are in a footprint: blocks in which none is are left without branches.
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

  /// Passes on the facets of one bin.
  template <class Visitor>
  GLINT_HD void visitBin(const TexelCover& cover, const BinList& list, Visitor& visitor) const {
    const double expected = static_cast<double>(list.size()) * cover.area() / static_cast<double>(map().texels.size());
    const double merged = list.grid < 0 ? 0 : std::clamp((expected - kFewTexels) / (kManyTexels - kFewTexels), 0.0, 1.0);
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

  // A facet's lobe is a Gaussian less its value kLobeEnd at the reach, scaled to integrate to 1.
  static constexpr float kLobeEnd = 3.7266532e-6f;  // exp(-kBinLobeReach^2 / 2)
  static constexpr float kLobeMass = 1 - kLobeEnd * (1 + 0.5f * kBinLobeReach * kBinLobeReach);

  GLINT_HD double lobe(const BinFacet& f, Vec2 h) const {
    const float xx = sigma_ * sigma_ + f.spread.xx, yy = sigma_ * sigma_ + f.spread.yy, xy = f.spread.xy;
    const float determinant = xx * yy - xy * xy;
    const Vec2 d = h - f.normal;
    const float squared = (yy * d.x * d.x - 2 * xy * d.x * d.y + xx * d.y * d.y) / determinant;
    if (!(squared < kBinLobeReach * kBinLobeReach)) return 0;
    return (std::exp(-0.5f * squared) - kLobeEnd) / (2 * kPi * kLobeMass * std::sqrt(determinant));
  }

  /// Mass of a facet's lobe in a box, as of a whole Gaussian: within 1e-4 of that of the lobe.
  GLINT_HD double mass(const BinFacet& f, const Box2& box) const {
    return gaussianMass(box.low.x, box.high.x, f.normal.x, std::sqrt(sigma_ * sigma_ + f.spread.xx)) *
           gaussianMass(box.low.y, box.high.y, f.normal.y, std::sqrt(sigma_ * sigma_ + f.spread.yy));
  }

  /// Radius, in deviations, inside which a lobe has the share u of its mass.
  static GLINT_HD float lobeRadius(float u) {
    // With t = radius^2 / 2, the share is (1 - exp(-t) - kLobeEnd t) / kLobeMass, concave: Newton from the left converges.
    const float wanted = u * kLobeMass, last = 0.5f * kBinLobeReach * kBinLobeReach;
    float t = -std::log1p(-std::min(wanted, 1 - kLobeEnd));
    for (int k = 0; k < 6; ++k) {
      const float tail = std::exp(-t);
      t = std::min(t + (wanted - 1 + tail + kLobeEnd * t) / std::max(tail - kLobeEnd, 1e-6f), last);
    }
    return std::sqrt(2 * std::max(t, 0.0f));
  }

  /// Normal of the texel at a point in coordinates of the footprint.
  GLINT_HD bool normalAt(const TexelCover& cover, double x, double y, Vec2& found) const {
    const auto wrapped = [](int i, int n) { return (i % n + n) % n; };
    const auto i = static_cast<std::uint32_t>(wrapped(cover.originX() + static_cast<int>(std::floor(x)), map().width));
    const auto j = static_cast<std::uint32_t>(wrapped(cover.originY() + static_cast<int>(std::floor(y)), map().height));
    const std::uint32_t c = lists_.texelClass(static_cast<std::uint64_t>(j) * map().width + i);
    bool done = false;
    const std::uint32_t* bins = map().class_bins.data() + c;
    lists_.forEachOccupied(bins[0], bins[1], [&](std::uint32_t bin, std::uint32_t ordinal) {
      std::uint32_t texel = 0;
      if (done || !lists_.find(lists_.list(bin, ordinal), i, j, texel)) return;
      found = normal(corner(bin), texel);
      done = true;
    });
    return done;
  }

  BinLists lists_;
  float sigma_ = 0;
  float bin_size_ = 0;
  bool one_bin_classes_ = false;
};

static_assert(NdfModel<BinMapNdf>);

}  // namespace glint
