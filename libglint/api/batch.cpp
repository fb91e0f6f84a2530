#include "glint/api/batch.h"

namespace glint::api {

void densities(const AnyNdf& model, std::size_t count, const FootprintArrays& footprints, const HalfVectorArrays& halves,
               float* out) {
  std::visit(
      [&](const auto& m) {
        for (std::size_t k = 0; k < count; ++k) out[k] = m.density(footprints[k], halves[k]);
      },
      model);
}

void means(const AnyNdf& model, std::size_t count, const FootprintArrays& footprints, const RangeArrays& ranges, float* out) {
  std::visit(
      [&](const auto& m) {
        for (std::size_t k = 0; k < count; ++k) out[k] = m.mean(footprints[k], ranges[k]);
      },
      model);
}

}  // namespace glint::api
