#include "glint/bake/sh/gauss_legendre.h"

#include <cmath>
#include <numbers>

namespace glint::bake {

GaussLegendre gaussLegendre(int n, double low, double high) {
  GaussLegendre rule{std::vector<double>(static_cast<std::size_t>(n)), std::vector<double>(static_cast<std::size_t>(n))};
  for (int k = 0; k < n; ++k) {
    // Newton's method finds the k-th root of P_n from the right, from Tricomi's estimate.
    double x = std::cos(std::numbers::pi * (k + 0.75) / (n + 0.5)), slope = 1;
    for (int step = 0; step < 100; ++step) {
      double value = 1, before = 0;
      for (int l = 1; l <= n; ++l) {
        const double next = ((2 * l - 1) * x * value - (l - 1) * before) / l;
        before = value;
        value = next;
      }
      slope = n * (x * value - before) / (x * x - 1);
      const double change = value / slope;
      x -= change;
      if (std::fabs(change) < 1e-16) break;
    }
    const std::size_t place = static_cast<std::size_t>(n - 1 - k);
    rule.nodes[place] = low + (high - low) * 0.5 * (1 + x);
    rule.weights[place] = (high - low) / ((1 - x * x) * slope * slope);
  }
  return rule;
}

}  // namespace glint::bake
