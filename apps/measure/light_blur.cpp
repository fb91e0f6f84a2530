#include "measure/light_blur.h"

#include <algorithm>
#include <cmath>
#include <cstddef>
#include <numbers>

namespace glint::apps {
namespace {

/// Replaces numbers, each `step` after the other, by their means over windows of `width` numbers. Beyond both ends they are 0.
void blurLine(float* first, std::size_t step, int count, double width, std::vector<double>& sums) {
  sums.assign(static_cast<std::size_t>(count) + 1, 0);
  for (int k = 0; k < count; ++k)
    sums[static_cast<std::size_t>(k) + 1] = sums[static_cast<std::size_t>(k)] + first[static_cast<std::size_t>(k) * step];
  const auto sumUpTo = [&](double x) {
    const double inside = std::clamp(x, 0.0, static_cast<double>(count));
    const auto below = static_cast<std::size_t>(std::min(std::floor(inside), count - 1.0));
    return sums[below] + (inside - static_cast<double>(below)) * (sums[below + 1] - sums[below]);
  };
  for (int k = 0; k < count; ++k) {
    const double middle = k + 0.5;
    const double mean = (sumUpTo(middle + width / 2) - sumUpTo(middle - width / 2)) / width;
    first[static_cast<std::size_t>(k) * step] = static_cast<float>(mean);
  }
}

}  // namespace

double halfVectorsOfLight(double light_deg) { return light_deg * std::numbers::pi / 180 / 2; }

double lightWidth(double light_deg, int resolution) {
  // A disk of radius r has the variance r^2 / 4 along an axis, a square of side w has w^2 / 12.
  const double side = std::numbers::sqrt3 * halfVectorsOfLight(light_deg) / 2;
  const double width = side * resolution / 2;
  return width < 1 ? 0 : width;
}

void blurByLight(std::vector<float>& image, int resolution, double light_deg) {
  const double width = lightWidth(light_deg, resolution);
  if (width == 0) return;
  std::vector<double> sums;
  const auto row = static_cast<std::size_t>(resolution);
  for (std::size_t j = 0; j < row; ++j) blurLine(image.data() + j * row, 1, resolution, width, sums);
  for (std::size_t i = 0; i < row; ++i) blurLine(image.data() + i, row, resolution, width, sums);
}

}  // namespace glint::apps
