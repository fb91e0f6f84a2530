#include "glint-plan/question.h"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>

#include "glint/bake/common/counter_random.h"
#include "measure/place_light.h"

namespace glint::apps {

std::vector<float> MapQuestion::sizes(int most, double cap) const {
  constexpr double kSame = 1.05;  // sizes that answers do not tell apart
  const double low = std::min(footprints.smallest, cap), high = std::min(footprints.largest, cap);
  if (high <= kSame * low) return {static_cast<float>(low)};
  const int count = std::clamp(static_cast<int>(std::ceil(std::log2(high / low))) + 1, 2, most);
  std::vector<float> sizes;
  for (int k = 0; k < count; ++k) sizes.push_back(static_cast<float>(low * std::pow(high / low, double(k) / (count - 1))));
  return sizes;
}

std::string MapQuestion::key() const {
  return fmt::format("{:.6g}..{:.6g} texels, sigma_r {:.6g}, light {:.6g} deg", footprints.smallest, footprints.largest,
                     sigma_r, light_deg);
}

PlaceTruth questionTruth(const NormalMap& map, const MapQuestion& question, std::uint64_t seed, std::size_t number,
                         float sigma_texels) {
  constexpr std::uint64_t kStream = 3000;
  const std::size_t places =
      lightPlaces(sigma_texels, question.sigma_r, question.light_deg, PlaceTruth::kResolution, kQuestionPlaces);
  std::vector<Footprint> footprints;
  for (std::uint64_t k = 0; k < places; ++k)
    footprints.push_back(Footprint::isotropic(bake::randomPair(seed, kStream + number, k), sigma_texels));
  return {map, std::move(footprints), kQuestionPlaces, question.sigma_r, question.light_deg};
}

}  // namespace glint::apps
