#include "glint-bench/rounded_image.h"

#include <cmath>

#include "measure/bench_errors.h"

namespace glint::apps {
namespace {

double threeDigits(double value) {
  if (!(value > 0)) return 0;
  constexpr double kSmallest = 1e-4;  // far below what is seen
  if (value < kSmallest) return 0;
  const double scale = std::pow(10.0, 2 - std::floor(std::log10(value)));
  return std::round(value * scale) / scale;
}

}  // namespace

nlohmann::ordered_json roundedImage(const std::vector<float>& image) {
  constexpr std::size_t kFine = SetTruth::kResolution, kCoarse = kFine / 2;
  nlohmann::ordered_json numbers = nlohmann::ordered_json::array();
  for (std::size_t j = 0; j < kCoarse; ++j) {
    for (std::size_t i = 0; i < kCoarse; ++i) {
      const float* low = image.data() + 2 * j * kFine + 2 * i;
      const float* high = low + kFine;
      numbers.push_back(threeDigits(0.25 * (double{low[0]} + double{low[1]} + double{high[0]} + double{high[1]})));
    }
  }
  return numbers;
}

}  // namespace glint::apps
