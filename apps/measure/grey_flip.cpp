#include "measure/grey_flip.h"

#include <algorithm>
#include <cmath>
#include <functional>
#include <numbers>

namespace glint::apps {
namespace {

constexpr double kPixelsPerDegree = 67;

/// One axis of a separable filter: weights of the pixels from -radius to radius.
struct Filter {
  int radius;
  std::vector<double> weights;
};

/// A filter of a function of the distance in pixels. Its positive weights sum to 1, and its negative ones to -1 where there are some.
Filter filterOf(int radius, const std::function<double(double)>& weight) {
  Filter filter{radius, {}};
  double above = 0, below = 0;
  for (int k = -radius; k <= radius; ++k) {
    const double w = weight(k);
    filter.weights.push_back(w);
    (w > 0 ? above : below) += std::fabs(w);
  }
  for (double& w : filter.weights) w /= w > 0 ? above : (below > 0 ? below : 1);
  return filter;
}

/// A grey picture of doubles; pixels beyond the border are those of the border.
class Grey {
 public:
  Grey(int width, int height) : width_(width), height_(height), pixels_(static_cast<std::size_t>(width) * height) {}
  Grey(const std::vector<float>& pixels, int width, int height)
      : width_(width), height_(height), pixels_(pixels.begin(), pixels.end()) {}

  double at(std::size_t k) const { return pixels_[k]; }

  Grey filtered(const Filter& along_x, const Filter& along_y) const { return axis(along_x, true).axis(along_y, false); }

 private:
  double clamped(int x, int y) const {
    const auto row = static_cast<std::size_t>(std::clamp(y, 0, height_ - 1));
    return pixels_[row * static_cast<std::size_t>(width_) + static_cast<std::size_t>(std::clamp(x, 0, width_ - 1))];
  }

  Grey axis(const Filter& filter, bool is_x) const {
    Grey result(width_, height_);
    std::size_t next = 0;
    for (int y = 0; y < height_; ++y) {
      for (int x = 0; x < width_; ++x, ++next) {
        double sum = 0;
        for (int k = -filter.radius; k <= filter.radius; ++k)
          sum += filter.weights[static_cast<std::size_t>(k + filter.radius)] * (is_x ? clamped(x + k, y) : clamped(x, y + k));
        result.pixels_[next] = sum;
      }
    }
    return result;
  }

  int width_, height_;
  std::vector<double> pixels_;
};

/// The eye's contrast sensitivity to luminance, as a blur (section 4.1.1). Its radius is that of the widest filter of the paper, of
/// yellow against blue.
Filter contrastFilter() {
  constexpr double kNarrow = 0.0047, kWidest = 0.04, kPi = std::numbers::pi;
  const int radius = static_cast<int>(std::ceil(3 * std::sqrt(kWidest / (2 * kPi * kPi)) * kPixelsPerDegree));
  return filterOf(radius, [](double pixels) {
    const double degrees = pixels / kPixelsPerDegree;
    return std::exp(-kPi * kPi / kNarrow * degrees * degrees);
  });
}

/// Filters that find edges and points (section 4.2.1): derivatives of a Gaussian of the width of a feature.
struct FeatureFilters {
  FeatureFilters() {
    constexpr double kFeatureDegrees = 0.082;
    const double sigma = 0.5 * kFeatureDegrees * kPixelsPerDegree, scale = 1 / (2 * sigma * sigma);
    const int radius = static_cast<int>(std::ceil(3 * sigma));
    const auto gaussian = [=](double x) { return std::exp(-scale * x * x); };
    smooth = filterOf(radius, gaussian);
    edge = filterOf(radius, [=](double x) { return -x * gaussian(x); });
    point = filterOf(radius, [=](double x) { return (2 * scale * x * x - 1) * gaussian(x); });
  }
  Filter smooth, edge, point;
};

/// Strength of the edges and of the points of a picture.
struct Features {
  Features(const Grey& picture, const FeatureFilters& filters)
      : edge_x(picture.filtered(filters.edge, filters.smooth)),
        edge_y(picture.filtered(filters.smooth, filters.edge)),
        point_x(picture.filtered(filters.point, filters.smooth)),
        point_y(picture.filtered(filters.smooth, filters.point)) {}
  double edge(std::size_t k) const { return std::hypot(edge_x.at(k), edge_y.at(k)); }
  double point(std::size_t k) const { return std::hypot(point_x.at(k), point_y.at(k)); }

 private:
  Grey edge_x, edge_y, point_x, point_y;
};

/// L* of CIELAB, 0 to 100.
double lightness(double luminance) {
  constexpr double kDark = 6.0 / 29;
  const double y = std::clamp(luminance, 0.0, 1.0);
  return 116 * (y > kDark * kDark * kDark ? std::cbrt(y) : y / (3 * kDark * kDark) + 4.0 / 29) - 16;
}

/// Difference of filtered colours, 0 to 1 (section 4.1.3): compressed above a share of the largest difference, green from blue.
double colourDifference(double truth, double image) {
  constexpr double kPower = 0.7, kShare = 0.4, kBelowShare = 0.95;
  constexpr double kGreenFromBlue = 203.3016546;  // HyAB distance of sRGB's (0, 1, 0) and (0, 0, 1), after the Hunt effect
  static const double most = std::pow(kGreenFromBlue, kPower);
  const double difference = std::pow(std::fabs(lightness(truth) - lightness(image)), kPower);
  if (difference < kShare * most) return difference * kBelowShare / (kShare * most);
  return kBelowShare + (difference - kShare * most) / (most - kShare * most) * (1 - kBelowShare);
}

}  // namespace

double greyFlip(const std::vector<float>& truth, const std::vector<float>& image, int width, int height) {
  const Filter contrast = contrastFilter();
  const FeatureFilters filters;
  const Grey right(truth, width, height), mine(image, width, height);
  const Grey right_seen = right.filtered(contrast, contrast), mine_seen = mine.filtered(contrast, contrast);
  const Features right_features(right, filters), mine_features(mine, filters);
  double sum = 0;
  for (std::size_t k = 0; k < truth.size(); ++k) {
    const double colour = colourDifference(right_seen.at(k), mine_seen.at(k));
    const double feature = std::max(std::fabs(right_features.edge(k) - mine_features.edge(k)),
                                    std::fabs(right_features.point(k) - mine_features.point(k)));
    sum += std::pow(colour, 1 - std::sqrt(std::numbers::sqrt2 / 2 * feature));  // Eq. 12 and 14
  }
  return truth.empty() ? 0 : sum / static_cast<double>(truth.size());
}

}  // namespace glint::apps
