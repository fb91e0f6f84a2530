#include "glint/bake/sh/light.h"

#include <tbb/global_control.h>
#include <tbb/parallel_for.h>
#include <tbb/task_arena.h>

#include <Eigen/Core>
#include <algorithm>
#include <cmath>
#include <numbers>

#include "glint/bake/sh/gauss_legendre.h"
#include "glint/bake/sh/lobes.h"
#include "glint/bake/sh/rotation.h"
#include "glint/math/half.h"
#include "glint/model/error.h"

namespace glint::bake {
namespace {

using Matrix = Eigen::Matrix<double, Eigen::Dynamic, Eigen::Dynamic, Eigen::RowMajor>;
using MatrixView = Eigen::Map<const Matrix>;

/// The largest coefficient of a direction is scaled to this. Halves from 6e-5 to 65504 have full accuracy, so coefficients down
/// to 2e-9 of the largest do.
constexpr float kLargestHalf = 32768;
/// Memory of one task. Without the limit, high orders would take gigabytes for each thread.
constexpr std::size_t kTaskBytes = std::size_t{64} << 20;

/// Normalised P_l^m(z), l = m .. order, at every node: [order - m + 1][nodes].
Matrix legendre(int m, int order, const std::vector<double>& z) {
  Matrix p(order - m + 1, static_cast<Eigen::Index>(z.size()));
  for (std::size_t k = 0; k < z.size(); ++k) {
    const auto column = static_cast<Eigen::Index>(k);
    const double sine = std::sqrt(std::max(0.0, (1 - z[k]) * (1 + z[k])));
    double value = 0.5 / std::sqrt(std::numbers::pi), before = 0;
    for (int i = 1; i <= m; ++i) value *= std::sqrt((2.0 * i + 1) / (2.0 * i)) * sine;
    for (int l = m; l <= order; ++l) {
      p(l - m, column) = value;
      const double n = l + 1.0, mm = static_cast<double>(m) * m, ll = static_cast<double>(l) * l;
      const double a = std::sqrt((4 * n * n - 1) / (n * n - mm)), b = l > m ? std::sqrt((ll - mm) / (4 * ll - 1)) : 0;
      const double next = a * (z[k] * value - b * before);
      before = value;
      value = next;
    }
  }
  return p;
}

/// Data that all tasks read.
struct Setup {
  const ShLightOptions& options;
  int band_limit;
  std::vector<double> light;                   ///< [3][shCount(band_limit)]: environment, times lightTaper
  std::vector<std::vector<double>> transfers;  ///< [order + 1]: halfVectorTransfer of every m
};

/// Computes the coefficients of some neighbouring columns of one row of the grid.
class LightTask {
 public:
  LightTask(const Setup& setup, int row, int first_column, int columns)
      : s_(setup), row_(row), first_(first_column), columns_(columns), width_(3 * columns) {}

  void run(ShLightData& data) {
    turn();
    const int order = s_.options.order;
    for (int m = 0; m <= order; ++m) {
      const MatrixView transfer(s_.transfers[m].data(), order - m + 1, s_.band_limit - m + 1);
      turned_cosines_[m] = (transfer * turned_cosines_[m]).eval();
      if (m > 0) turned_sines_[m] = (transfer * turned_sines_[m]).eval();
    }
    for (int k = 0; k < columns_; ++k) store(k, data);
  }

 private:
  /// Turns the environment to the outgoing directions. Only m up to the order matter, so bands beyond the order lose higher m.
  void turn() {
    const int order = s_.options.order;
    for (int m = 0; m <= order; ++m) {
      turned_cosines_.emplace_back(s_.band_limit - m + 1, width_);
      turned_sines_.emplace_back(m > 0 ? s_.band_limit - m + 1 : 0, width_);
    }
    ShRotationY rotation(std::numbers::pi * row_ / (s_.options.grid.rows - 1), s_.band_limit, order);
    Matrix cosines, sines;
    for (int l = 0;; ++l) {
      azimuth(l, cosines, sines);
      const Matrix c = MatrixView(rotation.cosines().data(), rotation.rowCount(), l + 1) * cosines;
      const Matrix s = MatrixView(rotation.sines().data(), rotation.rowCount(), l + 1) * sines;
      for (int m = 0; m < rotation.rowCount(); ++m) {
        turned_cosines_[m].row(l - m) = c.row(m);
        if (m > 0) turned_sines_[m].row(l - m) = s.row(m);
      }
      if (l == s_.band_limit) return;
      rotation.next();
    }
  }

  /// Turns band l of the environment about z by the azimuth of each column: f'(phi) = f(phi + azimuth).
  void azimuth(int l, Matrix& cosines, Matrix& sines) {
    cosines.resize(l + 1, width_);
    sines.resize(l + 1, width_);
    const std::size_t count = shCount(s_.band_limit);
    for (int m = 0; m <= l; ++m) {
      for (int k = 0; k < columns_; ++k) {
        const long long turns = static_cast<long long>(m) * (first_ + k) % s_.options.grid.columns;
        const double angle = 2 * std::numbers::pi * static_cast<double>(turns) / s_.options.grid.columns;
        const double cosine = std::cos(angle), sine = std::sin(angle);
        for (int channel = 0; channel < 3; ++channel) {
          const double* light = &s_.light[static_cast<std::size_t>(channel) * count];
          const double c = light[shIndex(l, m)], s = m > 0 ? light[shIndex(l, -m)] : 0;
          cosines(m, 3 * k + channel) = c * cosine + s * sine;
          sines(m, 3 * k + channel) = s * cosine - c * sine;
        }
      }
    }
  }

  /// Stores the coefficients of one outgoing direction, their scale, and the norm of each band.
  void store(int column, ShLightData& data) {
    const int order = s_.options.order;
    const std::size_t count = shCount(order);
    const std::size_t direction = static_cast<std::size_t>(row_) * s_.options.grid.columns + first_ + column;
    std::vector<float> values(3 * count);
    float* norms = &data.band_norms[direction * (static_cast<std::size_t>(order) + 1)];
    float largest = 0;
    for (int channel = 0; channel < 3; ++channel) {
      float* to = &values[static_cast<std::size_t>(channel) * count];
      for (int l = 0; l <= order; ++l) {
        double sum = 0;
        for (int m = -l; m <= l; ++m) {
          const Matrix& from = m >= 0 ? turned_cosines_[m] : turned_sines_[-m];
          const double value = from(l - std::abs(m), 3 * column + channel);
          to[shIndex(l, m)] = static_cast<float>(value);
          largest = std::max(largest, std::fabs(to[shIndex(l, m)]));
          sum += value * value;
        }
        norms[l] = std::max(norms[l], static_cast<float>(std::sqrt(sum)));
      }
    }
    if (data.light.precision == ShPrecision::f32) {
      data.scales[direction] = 1;
      std::copy(values.begin(), values.end(), data.floats.begin() + static_cast<std::ptrdiff_t>(direction * 3 * count));
      return;
    }
    const float scale = largest / kLargestHalf;
    data.scales[direction] = scale;
    std::uint16_t* to = &data.halves[direction * 3 * count];
    for (std::size_t k = 0; k < values.size(); ++k) to[k] = scale > 0 ? floatToHalf(values[k] / scale) : std::uint16_t{0};
  }

  const Setup& s_;
  int row_, first_, columns_, width_;
  std::vector<Matrix> turned_cosines_, turned_sines_;  ///< one matrix [bands][3 columns] for every m
};

int bandLimit(const ShLightOptions& options) {
  return options.band_limit > 0 ? options.band_limit : lightBandLimit(options.order);
}

/// Memory that a task takes for each column of the grid.
std::size_t columnBytes(const ShLightOptions& options) {
  return 2 * 3 * sizeof(double) * (static_cast<std::size_t>(options.order) + 1) * static_cast<std::size_t>(bandLimit(options));
}

/// Columns of a row that one task makes: as many as its memory allows.
int taskColumns(const ShLightOptions& options) {
  return std::clamp(static_cast<int>(kTaskBytes / columnBytes(options)), 1, options.grid.columns);
}

void requireUsableOptions(const ShLightOptions& options) {
  if (options.order < 0 || options.order > kMaxShLightOrder)
    throw Error(
        ErrorCode::usage, "sh.order", {}, "order",
        "light tables of order " + std::to_string(options.order) + " are not made: the time grows with the cube of the order",
        "give an order of 0 .. 300");
  requireUsableGrid(options.grid);
  if (options.grid.rows == 0)
    throw Error(ErrorCode::usage, "sh.grid", {}, {}, "a light table needs outgoing directions", "give a grid such as 17x32");
  if (options.band_limit != 0 && (options.band_limit < options.order || options.band_limit > 2 * lightBandLimit(options.order)))
    throw Error(ErrorCode::usage, "sh.band_limit", {}, {},
                "the band limit " + std::to_string(options.band_limit) + " is not between the order and twice " +
                    std::to_string(lightBandLimit(options.order)));
  // Beside the table, the transfers of every m take (order - m + 1)(band limit - m + 1) doubles: for each of the order^2
  // coefficients no more than 4 (band limit) bytes. Each thread has a task.
  const std::size_t threads = std::min<std::size_t>(
      tbb::this_task_arena::max_concurrency(), tbb::global_control::active_value(tbb::global_control::max_allowed_parallelism));
  const double tasks = static_cast<double>(threads * static_cast<std::size_t>(taskColumns(options)) * columnBytes(options));
  requireTableFits(options.order,
                   static_cast<double>(options.grid.directionCount()) * (options.precision == ShPrecision::f16 ? 6 : 12) +
                       4.0 * bandLimit(options) + tasks / static_cast<double>(shCount(options.order)),
                   options.max_bytes);
}

ShLightData emptyTable(const ShLightOptions& options) {
  ShLightData data;
  data.light.order = options.order;
  data.light.grid = options.grid;
  data.light.precision = options.precision;
  const std::size_t directions = options.grid.directionCount();
  data.scales.resize(directions);
  data.band_norms.resize(directions * (static_cast<std::size_t>(options.order) + 1));
  const std::size_t coefficients = directions * 3 * shCount(options.order);
  (options.precision == ShPrecision::f16 ? data.halves.resize(coefficients) : data.floats.resize(coefficients));
  return data;
}

}  // namespace

ShLight ShLightData::view() const {
  ShLight result = light;
  result.scales = scales;
  result.band_norms = band_norms;
  result.coefficients = light.precision == ShPrecision::f16 ? static_cast<const void*>(halves.data()) : floats.data();
  return result;
}

double lightTaper(int l, int band_limit) {
  const double x = (2.0 * l - band_limit) / (band_limit + 1.0);
  if (x <= 0) return 1;
  // All derivatives are continuous at both ends, so the error of the cut falls faster than any power of the band.
  const double rise = std::exp(-1 / x), fall = std::exp(-1 / (1 - x));
  return fall / (rise + fall);
}

std::vector<double> halfVectorTransfer(int m, int order, int band_limit) {
  // The integrand is a polynomial in t of degree 2 band_limit + order + 1, for which so many nodes are exact.
  const GaussLegendre rule = gaussLegendre(band_limit + order / 2 + 2, 0, 1);
  std::vector<double> mirrored;
  for (const double t : rule.nodes) mirrored.push_back(2 * t * t - 1);
  Matrix half = legendre(m, order, rule.nodes);
  for (Eigen::Index k = 0; k < half.cols(); ++k)
    half.col(k) *=
        2 * std::numbers::pi * 4 * rule.nodes[static_cast<std::size_t>(k)] * rule.weights[static_cast<std::size_t>(k)];
  const Matrix result = half * legendre(m, band_limit, mirrored).transpose();
  return {result.data(), result.data() + result.size()};
}

ShLightData buildShLight(const Environment& environment, const ShLightOptions& options, const ProgressFn& progress) {
  requireUsable(environment);
  requireUsableOptions(options);
  // Project the environment, fade its upper bands out, and compute the transfer to half vectors.
  Setup setup{options, bandLimit(options), {}, {}};
  setup.light = projectEnvironment(environment, setup.band_limit);
  for (std::size_t channel = 0; channel < 3; ++channel)
    for (int l = 0; l <= setup.band_limit; ++l)
      for (int m = -l; m <= l; ++m)
        setup.light[channel * shCount(setup.band_limit) + shIndex(l, m)] *= lightTaper(l, setup.band_limit);
  setup.transfers.resize(static_cast<std::size_t>(options.order) + 1);
  tbb::parallel_for(0, options.order + 1,
                    [&](int m) { setup.transfers[m] = halfVectorTransfer(m, options.order, setup.band_limit); });

  ShLightData data = emptyTable(options);
  const int columns = taskColumns(options);
  const int chunks = (options.grid.columns + columns - 1) / columns, tasks = chunks * options.grid.rows;
  ProgressCounter counter(progress, static_cast<std::size_t>(tasks));
  tbb::parallel_for(0, tasks, [&](int task) {
    const int first = task % chunks * columns;
    LightTask(setup, task / chunks, first, std::min(columns, options.grid.columns - first)).run(data);
    counter.advance();
  });
  return data;
}

}  // namespace glint::bake
