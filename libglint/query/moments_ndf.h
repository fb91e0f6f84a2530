#pragma once

#include <algorithm>
#include <cmath>

#include "glint/model/slope_moments.h"
#include "glint/query/anisotropic_ndf.h"
#include "glint/query/detail/common/footprint_weights.h"
#include "glint/query/detail/moments/moment_mixture.h"
#include "glint/query/detail/moments/slope_lobe.h"
#include "glint/query/ndf_model.h"

namespace glint {

/// The NDF from filtered moments of slopes (LEAN mapping, Olano and Baker 2010): one anisotropic Beckmann lobe whose slopes have
/// the mean and the covariance of the slopes under the footprint, plus the intrinsic roughness.
///
/// The cheapest model: it costs little more than a plain microfacet lobe, at any size. It holds where slopes under a footprint are
/// about normally distributed. It cannot show glints, nor the two lobes of a groove or of cloth.
///
/// A round footprint is answered from nine texels of each of two levels, mixed so that they have the variance of the footprint,
/// wherever it lies. A stretched footprint is answered from round ones along its long axis (isotropicParts), whose moments are
/// added. Boxes count as Gaussians of the same second moments. Footprints below the finest level are answered as wide as
/// smallestSigma().
/// Thread-safe, allocates nothing; the arrays must outlive it.
class MomentsNdf {
 public:
  /// @param sigma_r     intrinsic roughness of the facets, disk units
  /// @param most_parts  largest number of round footprints that stand for a stretched one, 1 to IsotropicParts::kMost
  GLINT_HD explicit MomentsNdf(const SlopeMoments& moments, float sigma_r, int most_parts = IsotropicParts::kMost)
      : moments_(moments), sigma_r_(sigma_r), most_parts_(std::clamp(most_parts, 1, int{IsotropicParts::kMost})) {
    for (int l = 0; l < moments_.level_count; ++l) variances_[l] = varianceOf(l);
  }

  GLINT_HD const SlopeMoments& slopeMoments() const { return moments_; }
  GLINT_HD float roughness() const { return sigma_r_; }

  /// Deviation, texels, with which footprints smaller than those of the finest level are answered.
  GLINT_HD float smallestSigma() const { return std::sqrt(variances_[0]); }
  /// Deviation, texels, from which on footprints are answered by the moments of the whole map.
  GLINT_HD float largestSigma() const { return std::sqrt(variances_[moments_.level_count - 1]); }

  /// Mean and covariance of the slopes under a footprint, without the intrinsic roughness.
  GLINT_HD MapSlopes slopes(const Footprint& p) const {
    const Vec2 centre = {wrapUnit(p.centre.x), wrapUnit(p.centre.y)};
    const Covariance& c = p.covariance;
    if (most_parts_ == 1 || (c.xx == c.yy && c.xy == 0)) return roundSlopes(centre, 0.5f * (c.xx + c.yy));
    const IsotropicParts parts = isotropicParts(p, moments_.width, moments_.height, 0, most_parts_, moments_.boundary);
    const auto slopesOf = [&](const Footprint& part) {
      return roundSlopes({wrapUnit(part.centre.x), wrapUnit(part.centre.y)}, part.covariance.xx);
    };
    const MapSlopes first = slopesOf(parts.footprints[0]);
    MomentMixture mixture(first.mean);
    mixture.add(parts.weights[0], first);
    for (int k = 1; k < parts.count; ++k) mixture.add(parts.weights[k], slopesOf(parts.footprints[k]));
    return mixture.moments();
  }

  /// The lobe of a footprint: for several questions about one footprint.
  GLINT_HD SlopeLobe lobe(const Footprint& p) const { return SlopeLobe(slopes(p), sigma_r_); }

  /// Density towards h, >= 0.
  GLINT_HD float density(const Footprint& p, Vec2 h) const { return lobe(p).density(h); }

  /// Average density over a box of half vectors; 0 if the box is empty.
  GLINT_HD float mean(const Footprint& p, const Box2& range) const {
    const float area = range.area();
    return area > 0 ? finitePositive(lobe(p).mass(range) / area) : 0.0f;
  }

  /// Half vector with probability density `density`, which is its pdf.
  GLINT_HD HalfVectorSample sample(const Footprint& p, Vec2 xi) const { return lobe(p).sample(xi); }

 private:
  /// The nine texels of a level around a point, weighed by quadratic splines.
  struct Place {
    int column[3], row[3];
    float weight_x[3], weight_y[3];
  };

  GLINT_HD float cellWidth(int level) const {
    return static_cast<float>(moments_.width) / static_cast<float>(moments_.levels[level].columns);
  }
  GLINT_HD float cellHeight(int level) const {
    return static_cast<float>(moments_.height) / static_cast<float>(moments_.levels[level].rows);
  }

  /// Variance along an axis of a level's answers, texels^2: 1/12 of a cell's square for the extent of its texels and 1/4 for the
  /// spline, wherever the point lies. An axis with one texel only does not count.
  GLINT_HD float varianceOf(int level) const {
    const float w = cellWidth(level), h = cellHeight(level);
    const bool one_column = moments_.levels[level].columns == 1, one_row = moments_.levels[level].rows == 1;
    if (one_column != one_row) return (one_column ? h * h : w * w) / 3;
    return one_column ? std::max(w * w, h * h) / 3 : (w * w + h * h) / 6;
  }

  /// Weights of the texels around a point along one axis. Beyond the border of a map that ends they are 0.
  GLINT_HD void placeAlong(float u, int count, int (&index)[3], float (&weight)[3]) const {
    const float x = u * static_cast<float>(count), cell = std::floor(x), f = x - cell;
    weight[0] = 0.5f * (1 - f) * (1 - f);
    weight[2] = 0.5f * f * f;
    weight[1] = 1 - weight[0] - weight[2];
    const bool clamp = moments_.boundary == Boundary::clamp;
    const int middle = std::min(static_cast<int>(cell), count - 1);
    index[0] = middle - 1, index[1] = middle, index[2] = middle + 1;
    if (index[0] < 0) index[0] = clamp ? 0 : count - 1, weight[0] = clamp ? 0.0f : weight[0];
    if (index[2] >= count) index[2] = clamp ? count - 1 : 0, weight[2] = clamp ? 0.0f : weight[2];
  }

  GLINT_HD Place placeAt(int level, Vec2 uv) const {
    Place place;
    placeAlong(uv.x, moments_.levels[level].columns, place.column, place.weight_x);
    placeAlong(uv.y, moments_.levels[level].rows, place.row, place.weight_y);
    return place;
  }

  GLINT_HD const MapSlopes* row(int level, int j) const {
    const SlopeMomentsLevel& grid = moments_.levels[level];
    return grid.texels.data() + rowMajorIndex(0, j, grid.columns);
  }

  GLINT_HD void add(int level, const Place& place, float weight, MomentMixture& mixture) const {
    for (int j = 0; j < 3; ++j) {
      const MapSlopes* texels = row(level, place.row[j]);
      for (int i = 0; i < 3; ++i) mixture.add(weight * place.weight_x[i] * place.weight_y[j], texels[place.column[i]]);
    }
  }

  /// Slopes under a round footprint: of the two levels whose variances enclose that of the footprint, mixed to have its variance.
  /// @param uv  in [0, 1)^2
  GLINT_HD MapSlopes roundSlopes(Vec2 uv, float asked) const {
    const float wanted = asked > 0 ? std::min(asked, 1e30f) : 0.0f;
    const int last = moments_.level_count - 1;
    // A cell of level l of the full chain is 2^l to 2^(l+1) texels wide.
    int level = std::clamp(static_cast<int>(0.5f * std::log2(std::max(3 * wanted, 1.0f))) - 1 - moments_.finest_level, 0, last);
    while (level < last && variances_[level + 1] <= wanted) ++level;
    const float below = variances_[level], above = variances_[std::min(level + 1, last)];
    const float t = above > below ? std::clamp((wanted - below) / (above - below), 0.0f, 1.0f) : 0.0f;
    const Place place = placeAt(level, uv);
    MomentMixture mixture(row(level, place.row[1])[place.column[1]].mean);
    add(level, place, 1 - t, mixture);
    if (t > 0) add(level + 1, placeAt(level + 1, uv), t, mixture);
    return mixture.moments();
  }

  SlopeMoments moments_;
  float variances_[SlopeMoments::kMaxLevels];  ///< of levels, texels^2
  float sigma_r_;
  int most_parts_;
};

static_assert(NdfModel<MomentsNdf>);

}  // namespace glint
