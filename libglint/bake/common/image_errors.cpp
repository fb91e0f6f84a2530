#include "glint/bake/common/image_errors.h"

#include <cmath>
#include <cstddef>

namespace glint::bake {

ImageErrors imageErrors(const std::vector<float>& image, const std::vector<float>& truth, int resolution) {
  double difference2 = 0, truth2 = 0, absolute = 0, sum = 0;
  for (std::size_t k = 0; k < image.size(); ++k) {
    const double d = double{image[k]} - double{truth[k]};
    difference2 += d * d;
    truth2 += double{truth[k]} * double{truth[k]};
    absolute += std::fabs(d);
    sum += double{image[k]};
  }
  const double area = 4.0 / (static_cast<double>(resolution) * resolution);
  return {std::sqrt(difference2 / truth2), 0.5 * absolute * area, sum * area - 1};
}

}  // namespace glint::bake
