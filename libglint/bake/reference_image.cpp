#include "glint/bake/reference_image.h"

#include <algorithm>
#include <cmath>

namespace glint::bake {
namespace {

/// Six deviations: 2e-9 of a lobe's mass lies outside.
constexpr float kImageReach = 6;

/// Adds lobes to pixels.
class LobeImage {
 public:
  LobeImage(int resolution, float sigma)
      : resolution_(resolution), sigma_(sigma), masses_(static_cast<std::size_t>(resolution) * resolution, 0.0) {}

  void addPoint(double weight, Vec2 n) {
    const Span x = span(n.x), y = span(n.y);
    across_.clear();
    for (int i = x.begin; i < x.end; ++i) across_.push_back(pixelMass(i, n.x));
    for (int j = y.begin; j < y.end; ++j) {
      const double row_weight = weight * pixelMass(j, n.y);
      double* row = masses_.data() + static_cast<std::size_t>(j) * resolution_;
      for (int i = x.begin; i < x.end; ++i) row[i] += row_weight * across_[i - x.begin];
    }
  }

  /// n^2 equal triangles, each at its centroid, with edges of at most 0.4 deviations: a rule of degree 1 on a
  /// grid, weakest at the borders of a triangle. Tests hold it against Reference::mean.
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
    int begin, end;
  };
  Span span(float n) const {
    const float half = 0.5f * static_cast<float>(resolution_), reach = kImageReach * sigma_;
    return {std::clamp(static_cast<int>((n - reach + 1) * half), 0, resolution_),
            std::clamp(static_cast<int>((n + reach + 1) * half) + 1, 0, resolution_)};
  }
  float pixelMass(int pixel, float n) const {
    const float size = 2.0f / static_cast<float>(resolution_), low = -1 + static_cast<float>(pixel) * size;
    return gaussianMass(low, low + size, n, sigma_);
  }

  int resolution_;
  float sigma_;
  std::vector<double> masses_;
  std::vector<float> across_;
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
