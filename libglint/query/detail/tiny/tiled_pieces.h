#pragma once

#include <algorithm>
#include <cmath>

#include "glint/model/tiny_example.h"
#include "glint/query/detail/tiny/cell_examples.h"
#include "glint/query/detail/tiny/example_elements.h"
#include "glint/query/detail/tiny/gaussian_lattice.h"
#include "glint/query/detail/tiny/moved_covariance.h"
#include "glint/query/detail/tiny/tiny_pieces.h"

namespace glint {

/// The pieces of a footprint on a plane of examples side by side.
///
/// The footprint is carried to the frame of the example, where the plane is periodic. There it weighs the texels, or the tiles of
/// the finest level of which at most kMostTiles are met. A footprint over many examples meets every tile, with nearly even weights,
/// so its cost does not grow.
class TiledPieces {
 public:
  static constexpr int kMostTiles = 64;
  static constexpr double kMostSquares = 1024;  ///< squares that are visited where they fall on at most kMostTiles tiles

  GLINT_HD explicit TiledPieces(const TinyExample& example)
      : size_(example.size()),
        levels_(example.exampleLevels()),
        sigma_r_(example.images.shape.sigma_r),
        elements_(example),
        to_example_(Matrix2{example.matrix[0], example.matrix[1], example.matrix[2], example.matrix[3]}.inverse()),
        offset_(example.offset) {}

  GLINT_HD void collect(const PlanePoint& point, const Covariance& covariance, TinyPieces& pieces) const {
    const UsableCovariance moved = movedCovariance(covariance, to_example_);
    const UsableCovariance c = usableCovariance(
        {static_cast<float>(moved.xx), static_cast<float>(moved.xy), static_cast<float>(moved.yy)}, size_, size_);
    double x, y;
    place(point, x, y);
    if (collectElements(c, x, y, pieces)) return;
    const int example = pieces.addExample(NormalTurn());
    for (int l = 0; l < levels_; ++l)
      if (collectTiles(c, x, y, l, example, pieces)) return;
    pieces.addImage(example, levels_ - 1, 0, 1);
  }

  /// Position in the example, [0, n)^2, of a point of the plane.
  GLINT_HD void place(const PlanePoint& point, double& x, double& y) const {
    const double n = size_;
    const double u = static_cast<double>(point.cell_x) * n + double{point.offset.x} - double{offset_.x};
    const double v = static_cast<double>(point.cell_y) * n + double{point.offset.y} - double{offset_.y};
    const auto wrapped = [n](double t) {
      const double rest = t - n * std::floor(t / n);
      return rest >= 0 && rest < n ? rest : 0;
    };
    x = wrapped(double{to_example_.xx} * u + double{to_example_.xy} * v);
    y = wrapped(double{to_example_.yx} * u + double{to_example_.yy} * v);
  }

 private:
  /// Adds elements if few enough are met.
  GLINT_HD bool collectElements(const UsableCovariance& c, double x, double y, TinyPieces& pieces) const {
    constexpr double kSeed = kSeedSigma * kSeedSigma;
    const GaussianLattice lattice(c, 1, elements_.smooth() ? -kSeed : 0.0);
    if (lattice.squares() > TinyPieces::kMost) return false;
    const ElementFootprint share(c, 1);
    lattice.forEach(x, y, [&](int i, int j, float weight) {
      const int column = wrapIndex(i, size_), row = wrapIndex(j, size_);
      const Vec2 n = elements_.normal(column, row);
      if (!elements_.smooth()) return pieces.addLobe(NormalLobe(n, sigma_r_), weight);
      const Vec2 away = {static_cast<float>(x - i - 0.5), static_cast<float>(y - j - 0.5)};
      pieces.addLobe(share.lobe(n, elements_.jacobian(column, row), away, sigma_r_), weight);
    });
    return true;
  }

  /// Adds tiles of a level if few enough are met.
  GLINT_HD bool collectTiles(const UsableCovariance& c, double x, double y, int level, int example, TinyPieces& pieces) const {
    const int side = 2 << level, columns = size_ / side;
    const GaussianLattice lattice(c, side, (side * side - 1) / 12.0);
    const double squares = lattice.squares();
    const auto number = [&](int i, int j) { return wrapIndex(j, columns) * columns + wrapIndex(i, columns); };
    if (columns * columns > kMostTiles) {
      if (squares > kMostTiles) return false;
      lattice.forEach(x / side, y / side,
                      [&](int i, int j, float weight) { pieces.addImage(example, level, number(i, j), weight); });
      return true;
    }
    if (squares > kMostSquares) return false;
    float sums[kMostTiles] = {};
    // Columns are a power of two, as n is.
    lattice.forEach(x / side, y / side,
                    [&](int i, int j, float weight) { sums[(j & (columns - 1)) * columns + (i & (columns - 1))] += weight; });
    for (int k = 0; k < columns * columns; ++k)
      if (sums[k] > 0) pieces.addImage(example, level, k, sums[k]);
    return true;
  }

  int size_, levels_;
  float sigma_r_;
  ExampleElements elements_;
  Matrix2 to_example_;
  Vec2 offset_;
};

}  // namespace glint
