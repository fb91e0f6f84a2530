#include "measure/place_light.h"

#include <tbb/parallel_for.h>

#include <algorithm>
#include <cmath>
#include <numbers>

#include "glint/bake/common/seen_error.h"
#include "glint/math/gaussian.h"
#include "glint/query/reference.h"
#include "measure/light_blur.h"

namespace glint::apps {
namespace {

/// Lobes end at so many deviations: beyond, a lobe of the deviation .005 has a density below 2e-3, and wider ones have less.
constexpr float kReach = 5.5f;

/// Shares of a blurred lobe in the pixels along one axis, for positions of its centre in the middle pixel. A light blurs by a box
/// along each axis, so a blurred lobe is still a product of two such profiles.
class BlurredProfile {
 public:
  BlurredProfile(float sigma_r, double light_deg, int resolution)
      : sigma_(0.5f * sigma_r * static_cast<float>(resolution)), width_(lightWidth(light_deg, resolution)) {
    radius_ = static_cast<int>(std::ceil(double{kReach * sigma_} + width_ / 2));
    for (int place = 0; place < kPlaces; ++place)
      for (int i = -radius_; i <= radius_; ++i) table_.push_back(share(i, (static_cast<float>(place) + 0.5f) / kPlaces));
  }
  int radius() const { return radius_; }
  int count() const { return 2 * radius_ + 1; }
  float sigma() const { return sigma_; }
  /// @param place  of the centre in the middle pixel, [0, 1)
  const float* at(float place) const {
    return table_.data() + static_cast<std::size_t>(std::min(static_cast<int>(place * kPlaces), kPlaces - 1)) * count();
  }

 private:
  static constexpr int kPlaces = 256;

  float share(int pixel, float centre) const {
    if (width_ == 0) return gaussianMass(static_cast<float>(pixel), static_cast<float>(pixel + 1), centre, sigma_);
    // The mean over the box, by its middle points in steps of a quarter of a pixel.
    const int steps = std::max(1, static_cast<int>(std::ceil(4 * width_)));
    float sum = 0;
    for (int k = 0; k < steps; ++k) {
      const auto shift = static_cast<float>(width_ * ((k + 0.5) / steps - 0.5));
      sum += gaussianMass(static_cast<float>(pixel), static_cast<float>(pixel + 1), centre + shift, sigma_);
    }
    return sum / static_cast<float>(steps);
  }

  float sigma_;
  double width_;
  int radius_ = 0;
  std::vector<float> table_;  // [kPlaces][count()]
};

/// The image of one footprint after the other.
class LightImage {
 public:
  LightImage(const BlurredProfile& profile, int resolution)
      : profile_(profile), resolution_(resolution), pixels_(static_cast<std::size_t>(resolution) * resolution, 0.0f) {}

  void addPoint(float weight, Vec2 normal) {
    each(normal, [&](std::size_t pixel, float share) { pixels_[pixel] += weight * share; });
  }

  /// Adds to the squares of lobes, too.
  void addPoint(float weight, Vec2 normal, std::vector<double>& squares) {
    each(normal, [&](std::size_t pixel, float share) {
      pixels_[pixel] += weight * share;
      squares[pixel] += double{weight} * share * share;
    });
  }

  /// Adds the mean square density of the image to sums, and begins a new image.
  /// @param total  of the weights
  void finish(double total, PlaceLight& light) {
    finish(total, light, [](std::size_t, double density, double) { return density * density; });
  }

  /// @param square  (pixel, density, density of a share of 1) -> the square that is added
  template <class Square>
  void finish(double total, PlaceLight& light, const Square& square) {
    const int side = bake::seenCellPixels(resolution_), cells = resolution_ / side;
    const double scale = 0.25 * resolution_ * resolution_ / total, share = 1.0 / (double(side) * side);
    for (std::size_t pixel = 0; pixel < pixels_.size(); ++pixel) {
      if (pixels_[pixel] == 0) continue;
      const int x = static_cast<int>(pixel) % resolution_, y = static_cast<int>(pixel) / resolution_;
      const auto cell =
          static_cast<std::size_t>(y / side) * static_cast<std::size_t>(cells) + static_cast<std::size_t>(x / side);
      const double density = scale * double{pixels_[pixel]};
      light.squares[cell] += share * square(pixel, density, scale);
      if (density > bake::kDarkestSeen) light.lit[cell] = 1;
      pixels_[pixel] = 0;
    }
  }

 private:
  /// Calls visit(pixel, share) for the pixels that the lobe of a normal reaches.
  template <class Visit>
  void each(Vec2 normal, const Visit& visit) const {
    const auto side = static_cast<float>(resolution_);
    const float x = (normal.x + 1) * 0.5f * side, y = (normal.y + 1) * 0.5f * side;
    const int left = static_cast<int>(std::floor(x)) - profile_.radius(),
              low = static_cast<int>(std::floor(y)) - profile_.radius();
    const float *across = profile_.at(x - std::floor(x)), *down = profile_.at(y - std::floor(y));
    const int first = std::max(0, -left), end = std::min(profile_.count(), resolution_ - left);
    for (int j = std::max(0, -low); j < std::min(profile_.count(), resolution_ - low); ++j) {
      const std::ptrdiff_t row = static_cast<std::ptrdiff_t>(low + j) * resolution_ + left;
      for (int i = first; i < end; ++i) visit(static_cast<std::size_t>(row + i), down[j] * across[i]);
    }
  }

  const BlurredProfile& profile_;
  int resolution_;
  std::vector<float> pixels_;
};

/// Normals in squares of the disk: those of a square have one lobe together, at their mean.
class NormalSquares {
 public:
  /// @param per_pixel  squares in a pixel along each axis
  NormalSquares(int per_pixel, int resolution)
      : side_(per_pixel * resolution), squares_(static_cast<std::size_t>(side_) * side_) {}

  void add(float weight, Vec2 normal) {
    const int x = along(normal.x), y = along(normal.y);
    const std::size_t k = static_cast<std::size_t>(y) * side_ + x;
    Square& square = squares_[k];
    if (square.weight == 0) touched_.push_back(k);
    square.weight += weight;
    square.offset = square.offset + weight * (normal - Vec2{middle(x), middle(y)});
  }

  /// Calls visit(weight, mean normal) for the squares that have weight, in the order in which they got it, and empties them.
  template <class Visit>
  void drain(const Visit& visit) {
    const auto side = static_cast<std::size_t>(side_);
    for (const std::size_t k : touched_) {
      Square& square = squares_[k];
      const Vec2 centre = {middle(static_cast<int>(k % side)), middle(static_cast<int>(k / side))};
      if (square.weight > 0) visit(square.weight, centre + (1 / square.weight) * square.offset);
      square = {};
    }
    touched_.clear();
  }

 private:
  struct Square {
    float weight = 0;
    Vec2 offset;  ///< sum of weight times (normal - middle of the square)
  };

  int along(float x) const { return std::clamp(static_cast<int>((x + 1) * 0.5f * static_cast<float>(side_)), 0, side_ - 1); }
  float middle(int k) const { return 2 * (static_cast<float>(k) + 0.5f) / static_cast<float>(side_) - 1; }

  int side_;
  std::vector<Square> squares_;
  std::vector<std::size_t> touched_;
};

/// Squares in a pixel along each axis that are at most a sixth of a lobe's deviation wide, which widens lobes by 0.1 %; 0: lobes are
/// so narrow that each normal has its own.
int squaresPerPixel(float sigma_pixels) {
  constexpr float kPerSigma = 6;
  constexpr int kMost = 8;  // 50 MB of squares at 256 pixels, of which few are touched
  const int squares = static_cast<int>(std::ceil(kPerSigma / sigma_pixels));
  return squares <= kMost ? squares : 0;
}

/// Whether so many texels are added faster by squares.
bool isLarge(const Footprint& footprint) {
  constexpr float kLargeTexels2 = 64;  // of variance: some thousand texels
  return footprint.covariance.xx + footprint.covariance.yy > 2 * kLargeTexels2;
}

PlaceLight darkness(int resolution) {
  const auto cells = static_cast<std::size_t>(resolution / bake::seenCellPixels(resolution));
  return {std::vector<double>(cells * cells, 0.0), std::vector<unsigned char>(cells * cells, 0)};
}

}  // namespace

PlaceLight placeLight(const NormalMap& map, std::span<const Footprint> footprints, float sigma_r, double light_deg,
                      int resolution) {
  // Parts do not depend on the number of threads, and are added in their order.
  constexpr std::size_t kParts = 16;
  const BlurredProfile profile(sigma_r, light_deg, resolution);
  const Reference reference(map, sigma_r, Surface::flat, Boundary::wrap);
  std::vector<PlaceLight> parts(kParts, darkness(resolution));
  tbb::parallel_for(std::size_t{0}, kParts, [&](std::size_t part) {
    LightImage image(profile, resolution);
    const int per_pixel = squaresPerPixel(profile.sigma());
    NormalSquares squares(per_pixel, resolution);
    for (std::size_t k = part; k < footprints.size(); k += kParts) {
      double total = 0;
      if (per_pixel > 0 && isLarge(footprints[k])) {
        total = reference.forEachTexel(footprints[k], [&](float w, Vec2 n) { squares.add(w, n); });
        squares.drain([&](float w, Vec2 n) { image.addPoint(w, n); });
      } else {
        total = reference.forEachTexel(footprints[k], [&](float w, Vec2 n) { image.addPoint(w, n); });
      }
      image.finish(total, parts[part]);
    }
  });
  PlaceLight light = darkness(resolution);
  for (const PlaceLight& part : parts) {
    for (std::size_t cell = 0; cell < light.lit.size(); ++cell) {
      light.squares[cell] += part.squares[cell];
      light.lit[cell] |= part.lit[cell];
    }
  }
  return light;
}

std::vector<double> leastLight(const NormalMap& map, float sigma_texels, float sigma_r, double light_deg, int resolution) {
  constexpr int kSquares = 4;  // in a pixel along each axis
  NormalSquares normals(kSquares, resolution);
  for (const Vec2& n : map.normals) normals.add(1, n);

  // The mean over texels of their lobes, and of the squares of their lobes.
  const BlurredProfile profile(sigma_r, light_deg, resolution);
  LightImage mean(profile, resolution);
  std::vector<double> squares(static_cast<std::size_t>(resolution) * resolution, 0.0);
  normals.drain([&](float count, Vec2 normal) { mean.addPoint(count, normal, squares); });

  // A footprint has the weight 1 / (4 pi sigma^2) in the sum of the squares of its weights.
  const double overlap = std::min(1.0, 1 / (4 * std::numbers::pi * double{sigma_texels} * sigma_texels));
  const auto texels = static_cast<double>(map.normals.size());
  PlaceLight light = darkness(resolution);
  mean.finish(texels, light, [&](std::size_t pixel, double density, double scale) {
    const double square_mean = scale * scale * texels * squares[pixel];
    return density * density + overlap * std::max(0.0, square_mean - density * density);
  });
  return light.squares;
}

std::size_t lightPlaces(float sigma_texels, float sigma_r, double light_deg, int resolution, std::size_t least) {
  constexpr double kMost = 2048, kMostPixels = 6e8, kDeviationsAcross = 7;
  const double across = kDeviationsAcross * sigma_texels;
  const double lobe = double{kReach * sigma_r} * resolution + lightWidth(light_deg, resolution) + 1;
  const double places = std::min(kMost, kMostPixels / (across * across * lobe * lobe));
  return std::max(least, static_cast<std::size_t>(places));
}

}  // namespace glint::apps
