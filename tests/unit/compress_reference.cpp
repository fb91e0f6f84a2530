#include "unit/compress_reference.h"

#include <Eigen/Cholesky>
#include <Eigen/Core>
#include <Eigen/Eigenvalues>
#include <Eigen/QR>
#include <random>

namespace glint::test {

using Eigen::MatrixXd;

double referenceCp(const float* slices, int count, int stride, int rank, double min_improvement, int max_sweeps,
                   unsigned seed) {
  std::mt19937 random(seed);
  std::normal_distribution<double> gaussian;
  const auto randomMatrix = [&](int rows) {
    MatrixXd m(rows, rank);
    for (int i = 0; i < m.size(); ++i) m.data()[i] = gaussian(random);
    return m;
  };
  MatrixXd x = randomMatrix(kBlockSize), y = randomMatrix(kBlockSize), z = randomMatrix(count);
  const auto value = [&](int s, int j, int i) { return static_cast<double>(slices[s * stride + j * kBlockSize + i]); };
  const auto solve = [&](const MatrixXd& a, const MatrixXd& b, const MatrixXd& products) -> MatrixXd {
    MatrixXd gram = (a.transpose() * a).cwiseProduct(b.transpose() * b);
    gram.diagonal().array() += 1e-6 * gram.trace() / rank;
    return gram.ldlt().solve(products.transpose()).transpose();
  };
  double energy = 0;
  for (int s = 0; s < count; ++s)
    for (int p = 0; p < kBlockPixels; ++p) energy += static_cast<double>(slices[s * stride + p]) * slices[s * stride + p];
  double error = energy;
  for (int sweep = 0; sweep < max_sweeps; ++sweep) {
    MatrixXd mx = MatrixXd::Zero(kBlockSize, rank), my = mx, mz = MatrixXd::Zero(count, rank);
    const auto accumulate = [&](auto add) {
      for (int s = 0; s < count; ++s)
        for (int j = 0; j < kBlockSize; ++j)
          for (int i = 0; i < kBlockSize; ++i) add(s, j, i, value(s, j, i));
    };
    accumulate([&](int s, int j, int i, double v) { mx.row(i) += v * y.row(j).cwiseProduct(z.row(s)); });
    x = solve(y, z, mx);
    accumulate([&](int s, int j, int i, double v) { my.row(j) += v * x.row(i).cwiseProduct(z.row(s)); });
    y = solve(x, z, my);
    accumulate([&](int s, int j, int i, double v) { mz.row(s) += v * x.row(i).cwiseProduct(y.row(j)); });
    z = solve(x, y, mz);
    double next = 0;
    accumulate([&](int s, int j, int i, double v) {
      const double e = v - x.row(i).cwiseProduct(y.row(j)).dot(z.row(s));
      next += e * e;
    });
    const bool done = std::sqrt(error / energy) - std::sqrt(next / energy) < min_improvement;
    error = next;
    if (done) break;
  }
  return error;
}

std::vector<double> squaredSingularValues(const std::vector<double>& columns, int rows) {
  const Eigen::Map<const MatrixXd> matrix(columns.data(), rows, static_cast<Eigen::Index>(columns.size()) / rows);
  const Eigen::SelfAdjointEigenSolver<MatrixXd> solver(matrix * matrix.transpose(), Eigen::EigenvaluesOnly);
  const Eigen::VectorXd& values = solver.eigenvalues();  // smallest first
  return {std::make_reverse_iterator(values.data() + rows), std::make_reverse_iterator(values.data())};
}

double squaredResidual(const std::vector<double>& basis, const std::vector<double>& vectors, int rows) {
  const auto matrix = [&](const std::vector<double>& v) {
    return Eigen::Map<const MatrixXd>(v.data(), rows, static_cast<Eigen::Index>(v.size()) / rows);
  };
  const Eigen::ColPivHouseholderQR<MatrixXd> solver(matrix(basis));
  return (matrix(vectors) - matrix(basis) * solver.solve(matrix(vectors))).squaredNorm();
}

}  // namespace glint::test
