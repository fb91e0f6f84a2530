#include "glint/bake/common/reference_image.h"

#include <algorithm>
#include <cmath>

namespace glint::bake {
namespace {

/// Lobes end at so many deviations, beyond which 2e-9 of their mass lies.
constexpr float kImageReach = 6;

/// Shares of a lobe's mass in the pixels along one axis, for any position of its centre in the middle pixel. Tabulated for a
/// number of positions, and linear between them.
class LobeProfile {
 public:
  /// @param sigma_pixels  deviation of the lobe, in pixels
  explicit LobeProfile(float sigma_pixels)
      : radius_(static_cast<int>(std::ceil(kImageReach * sigma_pixels))), count_(2 * radius_ + 1) {
    table_.reserve(static_cast<std::size_t>(kPlaces + 1) * count_);
    for (int place = 0; place <= kPlaces; ++place) {
      for (int i = -radius_; i <= radius_; ++i) {
        const auto left = static_cast<float>(i);
        table_.push_back(gaussianMass(left, left + 1, static_cast<float>(place) / kPlaces, sigma_pixels));
      }
    }
  }
  int radius() const { return radius_; }
  int count() const { return count_; }

  /// @param place   position of the centre in the middle pixel, [0, 1]
  /// @param shares  count() values
  void at(float place, double* shares) const {
    const int k = std::min(static_cast<int>(place * kPlaces), kPlaces - 1);
    const float t = place * kPlaces - static_cast<float>(k);
    const float* low = table_.data() + static_cast<std::size_t>(k) * count_;
    const float* high = low + count_;
    for (int i = 0; i < count_; ++i) shares[i] = low[i] + t * (high[i] - low[i]);
  }

 private:
  // Halfway between two positions, shares are 1e-5 off for the narrowest lobe (0.1 pixel), and 3e-7 off for 0.6 pixels.
  static constexpr int kPlaces = 1024;

  int radius_, count_;
  std::vector<float> table_;
};

/// An image to which lobes are added.
class LobeImage {
 public:
  LobeImage(int resolution, float sigma)
      : resolution_(resolution),
        sigma_(sigma),
        profile_(0.5f * sigma * static_cast<float>(resolution)),
        across_(profile_.count()),
        down_(profile_.count()),
        masses_(static_cast<std::size_t>(resolution) * resolution, 0.0) {}

  void addPoint(double weight, Vec2 n) {
    const Span x = place(n.x, across_), y = place(n.y, down_);
    for (int j = std::max(0, -y.first); j < std::min(y.count, resolution_ - y.first); ++j) {
      const double row_weight = weight * down_[j];
      double* row = masses_.data() + static_cast<std::ptrdiff_t>(y.first + j) * resolution_ + x.first;
      for (int i = std::max(0, -x.first); i < std::min(x.count, resolution_ - x.first); ++i) row[i] += row_weight * across_[i];
    }
  }

  /// Adds a triangle as the centroids of n^2 equal triangles, with edges of at most 0.4 deviations. Tests compare the result
  /// with Reference::mean.
  void addTriangle(double weight, Vec2 a, Vec2 b, Vec2 c) {
    const float longest = std::sqrt(std::max({dot(b - a, b - a), dot(c - b, c - b), dot(a - c, a - c)}));
    const int n = std::max(1, static_cast<int>(std::ceil(longest / (0.4f * sigma_))));
    const double share = weight / (double(n) * n);
    const auto point = [&](float u, float v) {
      return a + (u / static_cast<float>(n)) * (b - a) + (v / static_cast<float>(n)) * (c - a);
    };
    for (int u = 0; u < n; ++u) {
      for (int v = 0; v < n - u; ++v) {
        addPoint(share, point(static_cast<float>(u) + 1.0f / 3, static_cast<float>(v) + 1.0f / 3));
        if (v + 1 < n - u) addPoint(share, point(static_cast<float>(u) + 2.0f / 3, static_cast<float>(v) + 2.0f / 3));
      }
    }
  }

  std::vector<float> densities(double total) const {
    const double scale = 0.25 * resolution_ * resolution_ / total;
    std::vector<float> image(masses_.size());
    std::transform(masses_.begin(), masses_.end(), image.begin(), [&](double m) { return static_cast<float>(m * scale); });
    return image;
  }

 private:
  struct Span {
    int first, count;  // pixels; some can lie outside the image
  };
  /// Finds the pixels that a lobe reaches along one axis, and its shares in these pixels.
  Span place(float n, std::vector<double>& shares) const {
    const float at = (n + 1) * 0.5f * static_cast<float>(resolution_), pixel = std::floor(at);
    profile_.at(at - pixel, shares.data());
    return {static_cast<int>(pixel) - profile_.radius(), profile_.count()};
  }

  int resolution_;
  float sigma_;
  LobeProfile profile_;
  std::vector<double> across_, down_;
  std::vector<double> masses_;
};

}  // namespace

std::vector<float> referenceImage(const NormalMap& map, float sigma_r, Surface surface, Boundary boundary,
                                  const Footprint& footprint, int resolution) {
  const Reference reference(map, sigma_r, surface, boundary);
  LobeImage image(resolution, sigma_r);
  const double total =
      surface == Surface::flat
          ? reference.forEachTexel(footprint, [&](float w, Vec2 n) { image.addPoint(w, n); })
          : reference.forEachTriangle(footprint, [&](float w, Vec2 a, Vec2 b, Vec2 c) { image.addTriangle(w, a, b, c); });
  return image.densities(total);
}

}  // namespace glint::bake
