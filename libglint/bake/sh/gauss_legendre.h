#pragma once

#include <vector>

namespace glint::bake {

/// Quadrature that is exact for polynomials of degree 2n - 1.
struct GaussLegendre {
  std::vector<double> nodes;  ///< increasing
  std::vector<double> weights;
};

/// Nodes and weights of the rule with n >= 1 nodes on [low, high].
GaussLegendre gaussLegendre(int n, double low = -1, double high = 1);

}  // namespace glint::bake
