#pragma once

#include <vector>

#include "glint/model/normal_map.h"

namespace glint::bake {

/// A periodic height field between its texels: the cubic B-spline through the heights, which has continuous curvature. So the
/// phase of light runs smoothly from texel to texel. Lengths are in texels.
class HeightSpline {
 public:
  /// @param map  heights finite. O(texels)
  explicit HeightSpline(const HeightMap& map);

  int width() const { return width_; }
  int height() const { return height_; }

  /// Height at a point, texel (i, j) being centred at (i + 0.5, j + 0.5).
  double at(double x, double y) const;

  /// Coefficients of all columns for one y: rows[i] is that of column i mod width, for i from 0 to width + 2.
  void rowAt(double y, std::vector<double>& row) const;

  /// The steepest slope along u or v at texels and half-way between them, and where it is.
  struct Steepest {
    double slope = 0;
    int i = 0, j = 0;
  };
  Steepest steepest() const;

  /// Weights of four neighbouring coefficients at the position t in [0, 1) after the second.
  static void weights(double t, double (&w)[4]);
  /// The first of those coefficients, in [0, count), and the position after the second, of a coordinate.
  static int placeOf(double coordinate, int count, double& t);

 private:
  double& coefficient(int i, int j) { return coefficients_[static_cast<std::size_t>(j) * width_ + i]; }
  double coefficient(int i, int j) const {
    return coefficients_[static_cast<std::size_t>((j + height_) % height_) * width_ + (i + width_) % width_];
  }

  int width_, height_;
  std::vector<double> coefficients_;  // [height][width]
};

}  // namespace glint::bake
