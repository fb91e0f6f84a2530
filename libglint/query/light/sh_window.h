#pragma once

#include <cmath>
#include <cstdint>
#include <numbers>

#include "glint/math/device.h"

namespace glint {

/// Weights of bands in a series of spherical harmonics that is cut off. Without weights, bright spots ring: they have dark and
/// even negative rings around them.
enum class ShWindow : std::uint8_t {
  none,     ///< all bands alike: sharpest, rings most
  lanczos,  ///< sinc(l / (order + 1)): blurs a spot by about a quarter, rings a tenth of `none`
  hann,     ///< (1 + cos(pi l / (order + 1))) / 2: blurs a spot by about half, rings least
};

/// Weight of band l of a series that ends with band `order`; 1 at l = 0.
GLINT_HD inline float windowWeight(ShWindow window, int l, int order) {
  const float x = std::numbers::pi_v<float> * static_cast<float>(l) / static_cast<float>(order + 1);
  if (window == ShWindow::hann) return 0.5f * (1 + std::cos(x));
  if (window == ShWindow::lanczos) return l == 0 ? 1 : std::sin(x) / x;
  return 1;
}

}  // namespace glint
