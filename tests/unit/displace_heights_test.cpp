#include <gtest/gtest.h>

#include <Eigen/Dense>
#include <random>

#include "glint/bake/displace/downsample_heights.h"
#include "support/test_heights.h"

namespace glint::bake::displace_heights_test {
namespace {

/// Rounding of a transform and of the dense solver of the same problem, relative to heights of order 1.
constexpr double kSolverTolerance = 1e-11;

/// The rows of Eq. 10: two slopes and a Laplacian for each cell, and the mean.
Eigen::MatrixXd objectiveRows(int columns, int rows) {
  const int count = columns * rows;
  Eigen::MatrixXd a = Eigen::MatrixXd::Zero(3 * count + 1, count);
  const auto at = [&](int i, int j) { return (j + rows) % rows * columns + (i + columns) % columns; };
  for (int j = 0; j < rows; ++j) {
    for (int i = 0; i < columns; ++i) {
      const int k = at(i, j), h00 = k, h10 = at(i + 1, j), h01 = at(i, j + 1), h11 = at(i + 1, j + 1);
      a(3 * k, h11) += 0.5, a(3 * k, h10) += 0.5, a(3 * k, h01) -= 0.5, a(3 * k, h00) -= 0.5;
      a(3 * k + 1, h11) += 0.5, a(3 * k + 1, h01) += 0.5, a(3 * k + 1, h10) -= 0.5, a(3 * k + 1, h00) -= 0.5;
      const double w = std::sqrt(kLaplacianWeight);
      a(3 * k + 2, k) -= 4 * w;
      for (const auto& [di, dj] : {std::pair{1, 0}, {-1, 0}, {0, 1}, {0, -1}}) a(3 * k + 2, at(i + di, j + dj)) += w;
    }
  }
  a.row(3 * count).setConstant(1.0 / count);
  return a;
}

TEST(DownsampledHeights, SolveTheLeastSquaresProblemToMachinePrecision) {
  std::mt19937 random(1);
  std::normal_distribution<float> gauss;
  for (const auto& [columns, rows] : {std::pair{6, 4}, {5, 7}, {1, 3}, {8, 8}, {2, 2}}) {
    std::vector<Vec2> slopes(static_cast<std::size_t>(columns * rows));
    for (Vec2& s : slopes) s = {gauss(random), gauss(random)};
    Eigen::VectorXd b = Eigen::VectorXd::Zero(3 * columns * rows + 1);
    for (int k = 0; k < columns * rows; ++k) b(3 * k) = slopes[k].x, b(3 * k + 1) = slopes[k].y;
    b(3 * columns * rows) = 0.7;
    const Eigen::VectorXd wanted = objectiveRows(columns, rows).completeOrthogonalDecomposition().solve(b);
    const std::vector<double> heights = heightsFromSlopes(columns, rows, slopes, 0.7);
    for (int k = 0; k < columns * rows; ++k) EXPECT_NEAR(heights[k], wanted(k), kSolverTolerance) << columns << " " << k;
  }
}

TEST(DownsampledHeights, MeanSlopesAreThoseOfTheFacets) {
  const test::OwnedSurface map = test::synthSurface(SynthKind::isotropic, 24, 16);
  const auto surface = map.surface();
  const int factor = 4;
  const auto slopes = meanSlopes(map.heights, CellGrid::of(24, 16, factor));
  ASSERT_EQ(slopes.size(), 24u);
  for (int row = 0; row < 4; ++row) {
    for (int column = 0; column < 6; ++column) {
      Vec2 sum;
      for (int j = 0; j < factor; ++j)
        for (int i = 0; i < factor; ++i)
          for (std::size_t half = 0; half < 2; ++half)
            sum = sum + surface.slope(2 * static_cast<std::size_t>((row * factor + j) * 24 + column * factor + i) + half);
      const Vec2 mean = (1.0f / 32) * sum;
      EXPECT_NEAR(slopes[row * 6 + column].x, mean.x, 1e-5);  // float rounding of sums of 32
      EXPECT_NEAR(slopes[row * 6 + column].y, mean.y, 1e-5);
    }
  }
}

TEST(DownsampledHeights, MeanSlopesOfUnevenCellsAreThoseOfTheirFacets) {
  const test::OwnedSurface map = test::synthSurface(SynthKind::isotropic, 22, 13);
  const auto surface = map.surface();
  const CellGrid grid = CellGrid::of(22, 13, 4);
  ASSERT_EQ(grid.columns, 6);  // 5.5, rounded up
  ASSERT_EQ(grid.rows, 3);     // 3.25
  const auto slopes = meanSlopes(map.heights, grid);
  std::size_t covered = 0;
  for (int row = 0; row < grid.rows; ++row) {
    for (int column = 0; column < grid.columns; ++column) {
      Vec2 sum;
      float facets = 0;
      for (int j = grid.firstRow(row); j < grid.firstRow(row + 1); ++j)
        for (int i = grid.firstColumn(column); i < grid.firstColumn(column + 1); ++i)
          for (std::size_t half = 0; half < 2; ++half, ++facets)
            sum = sum + surface.slope(2 * static_cast<std::size_t>(j * 22 + i) + half);
      covered += static_cast<std::size_t>(facets);
      const std::size_t cell = static_cast<std::size_t>(row * grid.columns + column);
      EXPECT_NEAR(slopes[cell].x, sum.x / facets, 1e-5);  // float rounding of sums of 40
      EXPECT_NEAR(slopes[cell].y, sum.y / facets, 1e-5);
    }
  }
  EXPECT_EQ(covered, surface.facetCount());
}

TEST(DownsampledHeights, KeepSmoothReliefAndItsMean) {
  // A wave of 64 texels is hardly touched by cells of 4: the Laplacian's share of the objective is w k^2 = 0.0015.
  const int size = 64;
  std::vector<float> heights;
  for (int j = 0; j < size; ++j)
    for (int i = 0; i < size; ++i) heights.push_back(2 + 3 * std::sin(2 * 3.14159265f * static_cast<float>(i + j) / size));
  auto slopes = meanSlopes(heights, CellGrid::of(size, size, 4));
  const auto low = heightsFromSlopes(16, 16, slopes, 0.5);
  double mean = 0;
  for (int j = 0; j < 16; ++j) {
    for (int i = 0; i < 16; ++i) {
      mean += low[j * 16 + i] / 256;
      EXPECT_NEAR(4 * (low[j * 16 + i] - 0.5), heights[j * 4 * size + i * 4] - 2, 0.02 * 3);
    }
  }
  EXPECT_NEAR(mean, 0.5, 1e-12);
}

}  // namespace
}  // namespace glint::bake::displace_heights_test
