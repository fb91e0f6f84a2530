#pragma once

#include <algorithm>
#include <cmath>
#include <cstdint>

#include "glint/math/gaussian.h"
#include "glint/math/half.h"
#include "glint/query/detail/bin_map/bin_window.h"
#include "glint/query/detail/bin_map/facet_lobe.h"
#include "glint/query/detail/bin_map/lobe_sums.h"
#include "glint/query/detail/bin_map/subbin_moments.h"
#include "glint/query/detail/common/sampling.h"
#include "glint/query/ndf_model.h"

namespace glint {

/// A facet, or the facets of a block answered as one.
struct BinFacet {
  double weight = 0;  ///< share of the footprint
  Vec2 normal;
  Covariance spread;  ///< covariance of the normals of the facets, squared disk units; 0 for a single texel
};

/// How a density is made of the texels of a bin map.
enum class BinEstimator {
  exact,     ///< by the normals of the texels
  published  ///< by the weights of the 21 bins around the half vector and their centres (Atanasov 2021, section 5.2): mostly quicker, and less exact
};

/// The NDF from an inverse bin map (Atanasov 2021): exact shares of the footprint for every texel near the half vector.
///
/// Each texel in reach has a lobe (FacetLobe) around its own normal, which is stored to a fraction of a bin (blockCode). Where
/// a block has more than kManyTexels texels in the footprint, and is no wider than the lobe allows, one Gaussian replaces them,
/// with the mean and covariance of their normals. Between kFewTexels and kManyTexels both answers are blended, so that the
/// density is continuous in footprint and half vector. Blocks farther than kNear deviations from the half vector are counted, and
/// answered by the Gaussian of all their texels, the sooner the farther they are (farShare).
///
/// Boxes are answered exactly, Gaussians by the box of the same second moments. TexelCover also says how boxes without area and
/// boxes larger than the map are answered. Thread-safe, allocates nothing; the arrays must outlive it.
class BinMapNdf {
 public:
  /// Blocks with fewer texels in the footprint are summed texel by texel, blocks with more than kManyTexels as one Gaussian.
  static constexpr double kFewTexels = 256;
  static constexpr double kManyTexels = 512;
  /// Distance, in deviations of a facet's lobe, up to which bins are asked. The Gaussian of a block is wider than the lobe.
  static constexpr float kBinReach = 5.5f;
  /// Distance, in deviations, beyond which blocks may be answered by the Gaussian of all their texels.
  static constexpr float kNear = 2.5f;

  /// The NDF of the smallest roughness that the map is made for.
  GLINT_HD explicit BinMapNdf(const BinMap& map) : BinMapNdf(map, map.alpha_min) {}
  /// @param alpha  Beckmann roughness of the facets, alpha_min to alpha_max of the map
  /// @param estimator  of densities; means and samples are exact
  GLINT_HD BinMapNdf(const BinMap& map, float alpha, BinEstimator estimator = BinEstimator::exact)
      : blocks_(map), sigma_(alpha * kInvSqrt2), wider_(alpha / map.alpha), estimator_(estimator) {
    bin_size_ = 2.0f / static_cast<float>(map.bins_per_axis);
    block_classes_ = map.classCount() == map.blockCount();
  }

  GLINT_HD const BinMap& map() const { return blocks_.map(); }
  /// Deviation of a facet's lobe, disk units.
  GLINT_HD float sigma() const { return sigma_; }

  /// Density towards h, per unit projected area; >= 0.
  GLINT_HD float density(const Footprint& p, Vec2 h) const {
    if (!insideSquare(h)) return 0;
    return estimator_ == BinEstimator::published ? publishedDensity(p, h) : exactDensity(p, h);
  }

  /// Average density over a box of half vectors; 0 if the box is empty. O(bins that the box reaches and their texels).
  GLINT_HD float mean(const Footprint& p, const Box2& range) const {
    const Box2 box = insideSquare(range);
    if (!(box.width() > 0 && box.height() > 0)) return 0;
    double sum = 0;
    forEachFacet(p, box, [&](const BinFacet& f) { sum += f.weight * mass(f, box); });
    return finitePositive(static_cast<float>(sum / double{range.area()}));
  }

  /// Draws a half vector (Atanasov 2021, section 5.3 and Eq. 18): a point of the footprint, then a point of the lobe around the
  /// normal of the texel there. The leading digits of xi choose the point of the footprint, the other digits the point of the
  /// lobe.
  GLINT_HD HalfVectorSample sample(const Footprint& p, Vec2 xi) const {
    Vec2 normal;
    if (!sampleNormal(p, xi, normal)) return {};
    const float radius = sigma_ * FacetLobe::radius(xi.x), angle = 2 * kPi * xi.y;
    const Vec2 h = normal + radius * Vec2{std::cos(angle), std::sin(angle)};
    return insideSquare(h) ? drawnAt(h, exactDensity(p, h)) : HalfVectorSample{};
  }

  /// The normal of the texel at a point drawn evenly from the footprint. Uses up the leading digits of xi; the digits that are
  /// left are again uniform in [0, 1)^2.
  GLINT_HD bool sampleNormal(const Footprint& p, Vec2& xi, Vec2& normal) const {
    xi = clampUnit(xi);
    const TexelCover cover(p, map().width, map().height);
    double x = 0, y = 0;
    cover.point(xi.x, xi.y, x, y);
    xi = {fraction(xi.x * kStrata), fraction(xi.y * kStrata)};
    return normalAt(cover, x, y, normal);
  }

  /// Weights of the bins around h, exact to rounding in single precision; none for h outside the square [-1, 1]^2. O(texels of
  /// the footprint) or less, whichever way is shorter.
  GLINT_HD BinWeights weights(const Footprint& p, Vec2 h) const {
    if (!insideSquare(h)) return {};
    const BinWindow window(binAt(h.x), binAt(h.y), map().bins_per_axis);
    blocks_.prefetchTiles(window.bins);
    const TexelCover cover(p, map().width, map().height);
    WindowBlocks near;
    blocks_.forEachBlock(window.bins, [&](const BinBlock& block) {
      if (!window.isCorner(block)) near.blocks[near.count++] = block;
    });
    double areas[BinWindow::kSlots] = {};
    if (block_classes_ && shorterByTexel(cover, near))
      addByTexel(cover, window, near, areas);
    else
      addByBlock(cover, window, near, areas);
    return window.weights(areas, 1 / cover.area());
  }

  /// Calls visitor(BinFacet) for the facets of a footprint whose normals are in reach of a box of half vectors. Weights are
  /// shares of the footprint; they sum to less than 1 where other normals are out of reach.
  template <class Visitor>
  GLINT_HD void forEachFacet(const Footprint& p, const Box2& support, Visitor&& visitor) const {
    const TexelCover cover(p, map().width, map().height);
    const BinReach reach(support, kBinReach * sigma_);
    if (answeredByTexel(cover)) {
      forEachFacetByTexel(cover, reach, visitor);
      return;
    }
    CellRows rows;
    forEachBlockInReach(reach, [&](const BinBlock& block) { visitBlock(cover, block, reach, rows, visitor); });
  }

 private:
  static constexpr float kStrata = 4096;
  /// Texels of a footprint up to which each is looked up. By looking up, the time grows with the texels; by lists, with the bins.
  static constexpr double kMostLookedUp = 128;
  /// Blocks count as one facet unless the lobe is much narrower than the lobe for which bins as wide as the block are made.
  static constexpr double kNarrowestMerged = 0.9;

  /// A box of half vectors, and how far from it a normal counts.
  struct BinReach {
    GLINT_HD BinReach(const Box2& box, float distance) : support(box), radius(distance) {}
    /// Whether a part of a square is in reach.
    GLINT_HD bool meets(Vec2 low, float side) const {
      const float dx = std::max({low.x - support.high.x, support.low.x - low.x - side, 0.0f});
      const float dy = std::max({low.y - support.high.y, support.low.y - low.y - side, 0.0f});
      return dx * dx + dy * dy <= radius * radius;
    }
    Box2 support;
    float radius;
  };

  static GLINT_HD float fraction(float x) { return x - std::floor(x); }

  /// Row or column of bins at a coordinate; coordinates outside the square are moved to its border.
  GLINT_HD int binAt(float x) const {
    const auto last = static_cast<float>(map().bins_per_axis - 1);
    return static_cast<int>(std::clamp((x + 1) * 0.5f * static_cast<float>(map().bins_per_axis), 0.0f, last));
  }

  GLINT_HD BinRect binsIn(const BinReach& reach) const {
    const Box2& box = reach.support;
    return {binAt(box.low.x - reach.radius), binAt(box.high.x + reach.radius) + 1, binAt(box.low.y - reach.radius),
            binAt(box.high.y + reach.radius) + 1};
  }

  /// Number of texels in a footprint's bounding box. An int could overflow.
  static GLINT_HD double boxTexels(const TexelCover& cover) { return 1.0 * cover.columns() * cover.rows(); }

  /// Texels in one row of a footprint's bounding box. The first has coordinates (x, y) of the footprint and is texel
  /// (column, row) of the map.
  struct TexelRow {
    int x, y, column, row, count;
  };

  /// Calls visitor(TexelRow) for all texels of a footprint's bounding box, at most kMostAtOnce texels in a call.
  template <class Visitor>
  GLINT_HD void forEachTexelRow(const TexelCover& cover, Visitor&& visitor) const {
    for (int y = 0, j = cover.originY(); y < cover.rows(); ++y, j = j + 1 < map().height ? j + 1 : 0) {
      for (int x = 0, i = cover.originX(); x < cover.columns();) {
        const int count = std::min({cover.columns() - x, map().width - i, BinBlocks::kMostAtOnce});
        visitor(TexelRow{x, y, i, j, count});
        x += count;
        i = i + count < map().width ? i + count : 0;
      }
    }
  }

  /// Asks the memory for the classes of a small footprint: its rows are far apart in memory.
  GLINT_HD void prefetchClasses(const TexelCover& cover) const {
    constexpr int kMostRows = 40;
    if (cover.rows() > kMostRows) return;
    const int last = std::min(cover.originX() + cover.columns(), map().width) - 1;
    for (int y = 0, j = cover.originY(); y < cover.rows(); ++y, j = j + 1 < map().height ? j + 1 : 0) {
      const std::uint64_t row = static_cast<std::uint64_t>(j) * static_cast<std::uint64_t>(map().width);
      blocks_.prefetchClass(row + static_cast<std::uint64_t>(cover.originX()));
      blocks_.prefetchClass(row + static_cast<std::uint64_t>(last));
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
      for (std::uint64_t bits = blocks_.texelsOfClasses(indexOf(row), row.count, first, last); bits != 0; bits &= bits - 1) {
        const int k = lowestBit(bits);
        visitor(row.x + k, row.y, static_cast<std::uint32_t>(row.column + k), static_cast<std::uint32_t>(row.row),
                blocks_.texelClass(indexOf(row) + static_cast<std::uint64_t>(k)));
      }
    });
  }

  GLINT_DEVICE_CALL GLINT_HD float exactDensity(const Footprint& p, Vec2 h) const {
    const TexelCover cover(p, map().width, map().height);
    const BinReach reach({h, h}, kBinReach * sigma_);
    double sum = 0;
    const auto add = [&](const BinFacet& f) { sum += f.weight * lobe(f, h); };
    if (answeredByTexel(cover)) {
      forEachFacetByTexel(cover, reach, add);
      return finitePositive(static_cast<float>(sum));
    }
    BlockLobes blocks(*this, cover, h);
    forEachBlockInReach(reach, [&](const BinBlock& block) { blocks.add(block); });
    return finitePositive(static_cast<float>(blocks.sum() / cover.area()));
  }

  /// The lobes of the 21 bins around h, each around the centre of its bin.
  GLINT_DEVICE_CALL GLINT_HD float publishedDensity(const Footprint& p, Vec2 h) const {
    const auto across = static_cast<std::uint32_t>(map().bins_per_axis);
    const BinWeights bins = weights(p, h);
    double sum = 0;
    for (int k = 0; k < bins.count; ++k) {
      const Vec2 bin = {static_cast<float>(bins.bins[k] % across), static_cast<float>(bins.bins[k] / across)};
      sum += bins.weights[k] * lobe({1, Vec2{-1, -1} + bin_size_ * (bin + Vec2{0.5f, 0.5f}), {}}, h);
    }
    return finitePositive(static_cast<float>(sum));
  }

  /// Whether looking up every texel of a footprint is quicker than reading lists.
  static GLINT_HD bool answeredByTexel(const TexelCover& cover) {
    return cover.area() <= kMostLookedUp && boxTexels(cover) <= 2 * kMostLookedUp;
  }

  template <class Visitor>
  GLINT_HD void forEachBlockInReach(const BinReach& reach, Visitor&& visitor) const {
    blocks_.forEachBlock(binsIn(reach), [&](const BinBlock& block) {
      const float side = bin_size_ * static_cast<float>(block.side());
      if (reach.meets(corner(block), side)) visitor(block);
    });
  }

  /// Looks up every texel. For footprints of so few texels that no block counts as one facet.
  template <class Visitor>
  GLINT_HD void forEachFacetByTexel(const TexelCover& cover, const BinReach& reach, Visitor&& visitor) const {
    prefetchClasses(cover);
    const double scale = 1 / cover.area();
    const BinRect bins = binsIn(reach);
    const std::uint32_t first = blocks_.classOf(blocks_.tileKey(bins.column_begin, bins.row_begin, false));
    const std::uint32_t last = blocks_.classOf(blocks_.tileKey(bins.column_end - 1, bins.row_end - 1, true) - 1);
    forEachTexelOfClasses(cover, first, last, [&](int x, int y, std::uint32_t i, std::uint32_t j, std::uint32_t c) {
      BinTexel found;
      if (!blocks_.find(c, i, j, bins, found)) return;
      const double weight = cover.texel(x, y);
      if (weight > 0) visitor(BinFacet{scale * weight, normal(found.block, blocks_.code(found.block), found.code), {}});
    });
  }

  /// Whether looking up every texel of the footprint is cheaper than reading lists. Costs are nanoseconds, roughly.
  GLINT_HD bool shorterByTexel(const TexelCover& cover, const WindowBlocks& near) const {
    constexpr double kTexelCost = 1, kRowCost = 20, kTurnedCost = 6, kFindCost = 180;
    constexpr double kFirstCost = 250, kBlockCost = 50, kListCost = 0.3, kCellRowCost = 45;
    double by_texel = kTexelCost * boxTexels(cover) + kRowCost * cover.rows(), by_list = kFirstCost + kBlockCost * near.count;
    if (by_texel < 0.5 * by_list) return true;
    if (by_texel > kMostByTexel) return false;
    double texels = 0, found = 0;
    for (int k = 0; k < near.count; ++k) {
      const auto size = static_cast<double>(blocks_.end(near.blocks[k]) - blocks_.begin(near.blocks[k]));
      texels += size;
      found += size * (near.blocks[k].side_bits > 0 ? kFindCost : cover.aligned() ? 0 : kTurnedCost);
    }
    // Reading lists also reads the texels of a cell around the border; a cell has one to two times leaf_size texels.
    const double all = static_cast<double>(map().texels.size());
    const double cell = std::sqrt(all * 1.5 * map().leaf_size * near.count / std::max(texels, 1.0));
    const double border = 2 * (cover.columns() + cover.rows()) * cell + 2 * cell * cell;
    by_texel += found / all * boxTexels(cover);
    by_list += kListCost * texels / all * std::min(all, border) + kCellRowCost * cover.rows() / cell * near.count;
    return by_texel < by_list;
  }
  static constexpr double kMostByTexel = 1e5;

  /// Slots for texels in no bin of the window, and from kShared on for texels of a block of several bins.
  static constexpr std::uint8_t kNoSlot = BinWindow::kSlots, kShared = kNoSlot + 1;

  /// Looks at the class of every texel. Used where each class is one block, so that the class is the number of the block.
  GLINT_HD void addByTexel(const TexelCover& cover, const BinWindow& window, const WindowBlocks& near, double* areas) const {
    prefetchClasses(cover);
    std::uint8_t slots[BinMap::kMaxClasses];
    std::fill(slots, slots + map().classCount(), std::uint8_t{kNoSlot});
    bool shared = false;
    for (int k = 0; k < near.count; ++k) {
      const BinBlock& block = near.blocks[k];
      slots[block.number] = static_cast<std::uint8_t>(block.side_bits == 0 ? window.slotOf(block) : kShared + k);
      shared = shared || block.side_bits > 0;
    }
    if (cover.aligned() && !shared) {
      addAlignedTexels(cover, slots, areas);
      return;
    }
    forEachTexelRow(cover, [&](const TexelRow& row) {
      const auto one = [&](int k, std::uint32_t c) {
        int slot = slots[c];
        if (slot == kNoSlot) return;
        if (slot >= kShared) slot = slotIn(near.blocks[slot - kShared], window, row.column + k, row.row);
        if (slot < kNoSlot) areas[slot] += cover.texel(row.x + k, row.y);
      };
      blocks_.forEachClass(indexOf(row), row.count, one,
                           [&](int k, std::uint32_t c0, std::uint32_t c1, std::uint32_t c2, std::uint32_t c3) {
                             one(k, c0), one(k + 1, c1), one(k + 2, c2), one(k + 3, c3);
                           });
    });
  }

  /// The slot of a texel that is in a block, kNoSlot if it is not in the window.
  GLINT_HD int slotIn(const BinBlock& block, const BinWindow& window, int column, int row) const {
    std::uint32_t texel = 0;
    if (!blocks_.findIn(block, static_cast<std::uint32_t>(column), static_cast<std::uint32_t>(row), texel)) return kNoSlot;
    const TexelCode code = blocks_.code(block);
    const int shift = code.subbin_bits - block.side_bits;
    const int dx = block.column + static_cast<int>(code.subbinX(texel) >> shift) - window.column;
    const int dy = block.row + static_cast<int>(code.subbinY(texel) >> shift) - window.row;
    const bool inside = dx >= 0 && dx < BinWindow::kSide && dy >= 0 && dy < BinWindow::kSide;
    return inside ? dy * BinWindow::kSide + dx : int{kNoSlot};
  }

  /// Footprints with sides along the axes: counts each texel, without branches, in the slot of its class.
  GLINT_HD void addAlignedTexels(const TexelCover& cover, const std::uint8_t* slots, double* areas) const {
    // Four texels count in four arrays, so that an increment need not wait for the previous increment of its slot. Counts are
    // added to the areas where the covered height of rows changes.
    std::uint32_t counts[4][kNoSlot + 1] = {};
    const BoxSides sides(cover);
    int last_y = 0;
    const auto flush = [&](double height) {
      for (int slot = 0; slot < kNoSlot; ++slot) {
        areas[slot] += height * (1.0 * counts[0][slot] + counts[1][slot] + counts[2][slot] + counts[3][slot]);
        counts[0][slot] = counts[1][slot] = counts[2][slot] = counts[3][slot] = 0;
      }
    };
    forEachTexelRow(cover, [&](TexelRow row) {
      if (sides.row(row.y) != sides.row(last_y)) flush(sides.row(last_y));
      last_y = row.y;
      const auto edge = [&](std::uint64_t index, double width) {
        if (const int slot = slots[blocks_.texelClass(index)]; slot < kNoSlot) areas[slot] += width * sides.row(row.y);
      };
      if (row.x == 0) {
        edge(indexOf(row), sides.left);
        ++row.column, ++row.x, --row.count;
      }
      if (row.count > 0 && row.x + row.count - 1 == sides.last_x) {
        edge(indexOf(row) + static_cast<std::uint64_t>(row.count) - 1, sides.right);
        --row.count;
      }
      blocks_.forEachClass(
          indexOf(row), row.count, [&](int, std::uint32_t c) { ++counts[0][slots[c]]; },
          [&](int, std::uint32_t c0, std::uint32_t c1, std::uint32_t c2, std::uint32_t c3) {
            ++counts[0][slots[c0]], ++counts[1][slots[c1]], ++counts[2][slots[c2]], ++counts[3][slots[c3]];
          });
    });
    flush(sides.row(last_y));
  }

  /// Reads the lists of the window's blocks. Prefetches all of them first, so that their cache misses overlap.
  GLINT_FLATTEN GLINT_HD void addByBlock(const TexelCover& cover, const BinWindow& window, const WindowBlocks& near,
                                         double* areas) const {
    CellRows rows;
    for (int k = 0; k < near.count; ++k) blocks_.prefetchCells(cover, near.blocks[k], rows);
    WindowBlock blocks[BinWindow::kSlots];
    WindowSum sum(map().texels.data(), cover, areas);
    for (int k = 0; k < near.count; ++k) blocks[k] = WindowBlock(near.blocks[k], blocks_.code(near.blocks[k]), window);
    blocks_.forEachRun(cover, blocks, near.count, rows, sum);
    sum.finish();
  }

  /// Lower left corner of a block.
  GLINT_HD Vec2 corner(const BinBlock& block) const {
    return {-1 + static_cast<float>(block.column) * bin_size_, -1 + static_cast<float>(block.row) * bin_size_};
  }

  /// Side of a sub-bin.
  GLINT_HD float subbinSize(const BinBlock& block, const TexelCode& code) const {
    return bin_size_ / static_cast<float>(1 << (code.subbin_bits - block.side_bits));
  }

  GLINT_HD Vec2 normal(const BinBlock& block, const TexelCode& code, std::uint32_t texel) const {
    return corner(block) + subbinSize(block, code) * Vec2{static_cast<float>(code.subbinX(texel)) + 0.5f,
                                                          static_cast<float>(code.subbinY(texel)) + 0.5f};
  }

  /// Weight, 0 to 1, with which a block counts as one facet. The wider lobes are against the block, the fewer texels are needed
  /// for the same error. Is 0 in footprints of few texels, so that the answer equals looking up texel by texel.
  GLINT_HD double mergedShare(const TexelCover& cover, const BinBlock& block) const {
    const double wider = double{wider_} / block.side();
    if (wider < kNarrowestMerged) return 0;
    const double texels = std::min(std::max(1.0, wider * wider) * expectedTexels(cover, block), cover.area());
    return std::clamp((texels - kFewTexels) / (kManyTexels - kFewTexels), 0.0, 1.0);
  }

  /// Sums over all texels of a block.
  GLINT_HD SubbinMoments momentsOf(const BinBlock& block, const TexelCode& code) const {
    const std::uint16_t* stored = map().block_moments.data() + 5 * std::size_t{block.number};
    const double side = 1 << code.subbin_bits;
    const double x = side * (double{halfToFloat(stored[0])} - 0.5), y = side * (double{halfToFloat(stored[1])} - 0.5);
    const auto square = [&](int k) { return side * side * double{halfToFloat(stored[k])}; };
    SubbinMoments moments;
    moments.add(static_cast<double>(blocks_.end(block) - blocks_.begin(block)),
                {1, x, y, square(2) + x * x, square(3) + x * y, square(4) + y * y});
    return moments;
  }

  /// One facet for the texels of a block that are in the footprint; its weight is their covered area.
  GLINT_DEVICE_CALL GLINT_HD BinFacet blockFacet(const TexelCover& cover, const BinBlock& block, CellRows& rows) const {
    const TexelCode code = blocks_.code(block);
    SubbinMomentSum sum(map().texels.data(), cover, code, blocks_.begin(block), blocks_.end(block), momentsOf(block, code));
    blocks_.forEachRun(cover, block, rows, sum);
    const SubbinMoments& sums = sum.finish();
    if (!(sums.weight > 0)) return {};
    const double size = subbinSize(block, code), squared = size * size;
    const double x = sums.x / sums.weight, y = sums.y / sums.weight;
    const double xx = std::max(0.0, sums.xx / sums.weight - x * x), yy = std::max(0.0, sums.yy / sums.weight - y * y);
    const double limit = std::sqrt(xx * yy), xy = std::clamp(sums.xy / sums.weight - x * y, -limit, limit);
    const float middle = 0.5f * bin_size_ * static_cast<float>(block.side());
    const Vec2 mean = {static_cast<float>(size * x), static_cast<float>(size * y)};
    return {sums.weight,
            corner(block) + Vec2{middle, middle} + mean,
            {static_cast<float>(squared * xx), static_cast<float>(squared * xy), static_cast<float>(squared * yy)}};
  }

  /// Weight, 0 to 1, with which the texels of a block count by the moments of the whole block. Their lobes are in reach of h, but so far
  /// that the density hardly depends on where in the block the texels of the footprint are.
  GLINT_HD double farShare(const TexelCover& cover, const BinBlock& block, Vec2 h) const {
    if (double{wider_} / block.side() < kNarrowestMerged) return 0;
    const Vec2 low = corner(block);
    const float side = bin_size_ * static_cast<float>(block.side());
    const float dx = std::max({low.x - h.x, h.x - low.x - side, 0.0f}), dy = std::max({low.y - h.y, h.y - low.y - side, 0.0f});
    const float squared = (dx * dx + dy * dy) / (sigma_ * sigma_);
    if (squared <= kNear * kNear) return 0;
    // What an answer errs by is the less against the densities nearby, the more texels there are and the farther they are.
    const double more = std::exp(0.5f * squared) - std::exp(0.5f * kNear * kNear);
    const double texels = (more * expectedTexels(cover, block) - kFewTexels) / (kManyTexels - kFewTexels);
    return std::clamp(texels, 0.0, 1.0) * std::clamp(cover.area() / kMostLookedUp - 1, 0.0, 1.0);
  }
  /// Texels of a block in the footprint, if they were spread evenly over the map.
  GLINT_HD double expectedTexels(const TexelCover& cover, const BinBlock& block) const {
    const auto texels = static_cast<double>(blocks_.end(block) - blocks_.begin(block));
    return texels * cover.area() / static_cast<double>(map().texels.size());
  }
  /// The lobe at h of all texels of a block as one.
  GLINT_HD double lobeOfAll(const BinBlock& block, Vec2 h) const {
    const std::uint16_t* stored = map().block_moments.data() + 5 * std::size_t{block.number};
    const float side = bin_size_ * static_cast<float>(block.side()), squared = side * side;
    const Vec2 mean = corner(block) + side * Vec2{halfToFloat(stored[0]), halfToFloat(stored[1])};
    const auto variance = [&](int k) { return squared * halfToFloat(stored[k]); };
    return lobe({1, mean, {variance(2), variance(3), variance(4)}}, h);
  }

  /// Adds up the lobes of blocks at a half vector, each times its area in the footprint. Reads the lists of many blocks together, so
  /// that their cache misses overlap.
  class BlockLobes {
   public:
    GLINT_HD BlockLobes(const BinMapNdf& ndf, const TexelCover& cover, Vec2 h)
        : ndf_(ndf), cover_(cover), h_(h), factor_(1 / double{2 * kPi * FacetLobe::kMass * ndf.sigma_ * ndf.sigma_}) {}
    GLINT_HD void add(const BinBlock& block) {
      const double far = ndf_.farShare(cover_, block, h_);
      const double merged = (1 - far) * ndf_.mergedShare(cover_, block), apart = 1 - far - merged;
      if (merged > 0)
        ndf_.visitMerged(cover_, block, merged * cover_.area(), rows_,
                         [&](const BinFacet& f) { sum_ += f.weight * ndf_.lobe(f, h_); });
      if (merged == 1) return;
      ndf_.blocks_.prefetchCells(cover_, block, rows_);
      shares_[count_] = {far, apart};
      blocks_[count_++] = {block, ndf_.blocks_.code(block), ndf_.lobeFrom(block, h_), far > 0, apart > 0};
      if (count_ == LobeSums::kMostBlocks) flush();
    }
    GLINT_HD double sum() {
      flush();
      return sum_;
    }

   private:
    struct Shares {
      double far, apart;
    };

    GLINT_HD void flush() {
      LobeSums sums(ndf_.map().texels.data(), cover_, blocks_);
      ndf_.blocks_.forEachRun(cover_, blocks_, count_, rows_, sums);
      sums.finish();
      for (int k = 0; k < count_; ++k) {
        if (sums.area(k) > 0) sum_ += shares_[k].far * sums.area(k) * ndf_.lobeOfAll(blocks_[k].block, h_);
        sum_ += shares_[k].apart * factor_ * sums.lobes(k);
      }
      count_ = 0;
    }

    const BinMapNdf& ndf_;
    const TexelCover& cover_;
    Vec2 h_;
    double factor_;  ///< of the lobes of single texels
    double sum_ = 0;
    int count_ = 0;
    CellRows rows_;
    LobeBlock blocks_[LobeSums::kMostBlocks];
    Shares shares_[LobeSums::kMostBlocks];
  };

  /// The half vector as texels of a block see it.
  GLINT_HD SubbinLobe lobeFrom(const BinBlock& block, Vec2 h) const {
    const TexelCode code = blocks_.code(block);
    const float size = subbinSize(block, code), middle = 0.5f * static_cast<float>(1 << code.subbin_bits);
    const Vec2 at = (1 / size) * (h - corner(block)) - Vec2{middle, middle};
    return {at.x, at.y, 0.5f * size * size / (sigma_ * sigma_)};
  }

  /// A visitor of runs that makes one facet of each texel that is in reach and in the footprint.
  template <class Visitor>
  class EachTexel {
   public:
    GLINT_HD EachTexel(const BinMapNdf& ndf, const TexelCover& cover, const BinBlock& block, const BinReach& reach,
                       double scale, Visitor& visitor)
        : ndf_(ndf),
          cover_(cover),
          sides_(cover),
          block_(block),
          code_(ndf.blocks_.code(block)),
          scale_(scale),
          visitor_(visitor) {
      const Vec2 low = reach.support.low - Vec2{reach.radius, reach.radius},
                 high = reach.support.high + Vec2{reach.radius, reach.radius};
      const Vec2 corner = ndf.corner(block);
      columns_ = subbinsBetween(low.x - corner.x, high.x - corner.x);
      rows_ = subbinsBetween(low.y - corner.y, high.y - corner.y);
    }
    GLINT_HD void whole(std::uint64_t begin, std::uint64_t end) { partial({begin, end, 0, 0, false, false}); }
    GLINT_DEVICE_CALL GLINT_HD void partial(const TexelRun& run) {
      withCut(run, [&](auto cut) { add<cut()>(run); });
    }

   private:
    GLINT_HD IndexRange subbinsBetween(float begin, float end) const {
      const float size = ndf_.subbinSize(block_, code_), last = static_cast<float>((1 << code_.subbin_bits) - 1);
      return {static_cast<int>(std::clamp(std::floor(begin / size), 0.0f, last)),
              static_cast<int>(std::clamp(std::floor(end / size), 0.0f, last))};
    }

    template <unsigned kCut>
    GLINT_HD void add(const TexelRun& run) {
      const TexelFilter near(code_, columnsIn(cover_, run), rowsIn(cover_, run), columns_, rows_);
      const auto pass = [&](std::uint32_t texel) {
        const double weight = sides_.texelArea<kCut>(cover_, run, code_, texel);
        if (weight > 0) visitor_(BinFacet{scale_ * weight, ndf_.normal(block_, code_, texel), {}});
      };
      near.forEach<kCut | TexelFilter::kSubbin>(ndf_.map().texels.data() + run.begin, run.end - run.begin, pass);
    }

    const BinMapNdf& ndf_;
    const TexelCover& cover_;
    BoxSides sides_;
    const BinBlock& block_;
    TexelCode code_;
    double scale_;
    Visitor& visitor_;
    IndexRange columns_, rows_;  ///< range of sub-bins in reach
  };

  /// Calls visitor(BinFacet) for the facets of one block.
  template <class Visitor>
  GLINT_HD void visitBlock(const TexelCover& cover, const BinBlock& block, const BinReach& reach, CellRows& rows,
                           Visitor& visitor) const {
    const double merged = mergedShare(cover, block);
    if (merged < 1) {
      EachTexel<Visitor> each(*this, cover, block, reach, (1 - merged) / cover.area(), visitor);
      blocks_.forEachRun(cover, block, rows, each);
    }
    if (merged > 0) visitMerged(cover, block, merged, rows, visitor);
  }

  template <class Visitor>
  GLINT_HD void visitMerged(const TexelCover& cover, const BinBlock& block, double merged, CellRows& rows,
                            Visitor&& visitor) const {
    BinFacet facet = blockFacet(cover, block, rows);
    facet.weight *= merged / cover.area();
    if (facet.weight > 0) visitor(facet);
  }

  GLINT_HD double lobe(const BinFacet& f, Vec2 h) const {
    const float squared = sigma_ * sigma_;
    return FacetLobe::density({squared + f.spread.xx, f.spread.xy, squared + f.spread.yy}, h - f.normal);
  }

  /// Mass of a facet in a box. Takes the lobe for a Gaussian that does not end, which is right to 1e-4.
  GLINT_HD double mass(const BinFacet& f, const Box2& box) const {
    return gaussianMass(box.low.x, box.high.x, f.normal.x, std::sqrt(sigma_ * sigma_ + f.spread.xx)) *
           gaussianMass(box.low.y, box.high.y, f.normal.y, std::sqrt(sigma_ * sigma_ + f.spread.yy));
  }

  /// Normal of the texel at a point in coordinates of the footprint.
  GLINT_HD bool normalAt(const TexelCover& cover, double x, double y, Vec2& found) const {
    const auto wrapped = [](int i, int n) { return (i % n + n) % n; };
    const auto i = static_cast<std::uint32_t>(wrapped(cover.originX() + static_cast<int>(std::floor(x)), map().width));
    const auto j = static_cast<std::uint32_t>(wrapped(cover.originY() + static_cast<int>(std::floor(y)), map().height));
    const std::uint32_t c = blocks_.texelClass(static_cast<std::uint64_t>(j) * static_cast<std::uint64_t>(map().width) + i);
    BinTexel texel;
    const int bins = map().bins_per_axis;
    if (!blocks_.find(c, i, j, {0, bins, 0, bins}, texel)) return false;
    found = normal(texel.block, blocks_.code(texel.block), texel.code);
    return true;
  }

  BinBlocks blocks_;
  float sigma_ = 0;
  float wider_ = 1;  ///< deviation of the lobe over the deviation that the bins are made for
  float bin_size_ = 0;
  BinEstimator estimator_;
  bool block_classes_ = false;  ///< whether the class of a texel is the number of its block
};

static_assert(NdfModel<BinMapNdf>);

}  // namespace glint
