#include "glint/bake/bin_map/bin_map_image.h"

#include <tbb/parallel_for.h>

#include <algorithm>
#include <cmath>
#include <cstddef>
#include <span>

#include "glint/math/gaussian.h"

namespace glint::bake {
namespace {

/// Shares of a facet in the pixels along one axis. A facet of a damaged file, whose numbers are not finite, has none.
struct AxisShares {
  AxisShares(float centre, float sigma, int resolution) {
    if (!std::isfinite(centre) || !(sigma > 0)) return;
    const float pixel = 2.0f / static_cast<float>(resolution);
    const auto pixelAt = [&](float x) {
      return static_cast<int>(std::floor(std::clamp((x + 1) / pixel, 0.0f, 1.0f * static_cast<float>(resolution))));
    };
    first = pixelAt(centre - kLobeReach * sigma);
    const int end = std::min(pixelAt(centre + kLobeReach * sigma) + 1, resolution);
    for (int k = first; k < end; ++k) {
      const float low = -1 + static_cast<float>(k) * pixel;
      shares.push_back(gaussianMass(low, low + pixel, centre, sigma));
    }
  }
  /// 0 for pixels that the facet does not reach.
  float at(int pixel) const {
    const int k = pixel - first;
    return k >= 0 && k < static_cast<int>(shares.size()) ? shares[static_cast<std::size_t>(k)] : 0;
  }

  int first = 0;
  std::vector<float> shares;
};

struct FacetShares {
  float weight = 0;
  AxisShares across, down;
};

/// Adds facets to all rows of an image. Each row is of one thread, and adds facets in their order: the sum does not depend on the number
/// of threads.
void addFacets(std::span<const FacetShares> facets, int resolution, std::vector<double>& image) {
  tbb::parallel_for(0, resolution, [&](int y) {
    double* row = image.data() + static_cast<std::size_t>(y) * static_cast<std::size_t>(resolution);
    for (const FacetShares& facet : facets) {
      const double weight = double{facet.weight} * double{facet.down.at(y)};
      if (weight == 0) continue;
      const std::vector<float>& across = facet.across.shares;
      for (std::size_t k = 0; k < across.size(); ++k)
        row[static_cast<std::size_t>(facet.across.first) + k] += weight * double{across[k]};
    }
  });
}

}  // namespace

std::vector<float> binMapImage(const BinMapNdf& ndf, const Footprint& footprint, int resolution, const ProgressFn& progress) {
  constexpr std::size_t kAtOnce = 1024;  // facets; their shares are in memory together
  std::vector<BinFacet> facets;
  ndf.forEachFacet(footprint, {{-1, -1}, {1, 1}}, [&](const BinFacet& facet) { facets.push_back(facet); });

  const auto side = static_cast<std::size_t>(resolution);
  std::vector<double> sums(side * side, 0.0);
  ProgressCounter counter(progress, facets.size());
  for (std::size_t k = 0; k < facets.size(); k += kAtOnce) {
    std::vector<FacetShares> some;
    for (std::size_t i = k; i < std::min(k + kAtOnce, facets.size()); ++i) {
      const BinFacet& f = facets[i];
      const float squared = ndf.sigma() * ndf.sigma();
      some.push_back({static_cast<float>(f.weight), AxisShares(f.normal.x, std::sqrt(squared + f.spread.xx), resolution),
                      AxisShares(f.normal.y, std::sqrt(squared + f.spread.yy), resolution)});
      counter.advance();
    }
    addFacets(some, resolution, sums);
  }

  const double pixel_area = 4.0 / (double(resolution) * resolution);
  std::vector<float> image(sums.size());
  std::transform(sums.begin(), sums.end(), image.begin(), [&](double sum) { return static_cast<float>(sum / pixel_area); });
  return image;
}

}  // namespace glint::bake
