#include "glint/bake/sh/lobes.h"

#include <fmt/format.h>
#include <tbb/parallel_for.h>

#include <algorithm>
#include <cmath>
#include <cstdio>
#include <numbers>
#include <string>

#include "glint/bake/sh/gauss_legendre.h"
#include "glint/math/half.h"
#include "glint/model/error.h"
#include "glint/query/light/sh_basis.h"

namespace glint::bake {
namespace {

constexpr int kPanelNodes = 16;
/// A panel of 16 nodes integrates half a period of P_l with an error below 1e-16.
constexpr double kPanelPhase = std::numbers::pi;
/// The lobe exp(-sin^2 / (2 sigma^2)) is below 1e-17 of its peak beyond this many sigma.
constexpr double kLobeReachSigmas = 9;

void requireOrder(int order) {
  if (order >= 0 && order <= kMaxShOrder) return;
  throw Error(ErrorCode::usage, "sh.order", {}, "order", std::to_string(order) + " is not in 0 .. 1000",
              "give an order in that range");
}

/// Fills the directions of one polar angle.
void fillRow(int row, const std::vector<double>& f, const ShRecurrence<double>& recurrence, ShLobesData& data) {
  const int order = data.lobes.order, columns = data.lobes.grid.columns;
  const std::size_t count = shCount(order), bands = static_cast<std::size_t>(order) + 1;
  // At azimuth 0, harmonics of cosines are sqrt(2) P_l^m. Other directions of the row differ from these in azimuth only.
  std::vector<double> first(count), scratch(ShAccumulator<double>::scratchSize(order));
  ShAccumulator<double> sum(recurrence, order, first, scratch);
  const bool pole = row == 0 || row == data.lobes.grid.rows - 1;
  const double theta = std::numbers::pi * row / (data.lobes.grid.rows - 1);
  sum.add(pole ? 0.0 : std::sin(theta), 0, std::cos(theta), 1);
  sum.flush();
  std::vector<double> cosines(bands), sines(bands);
  std::vector<float> values(count);
  for (int column = 0; column < columns; ++column) {
    for (int m = 0; m <= order; ++m) {
      const double turns = static_cast<double>(static_cast<long long>(m) * column % columns) / columns;
      cosines[static_cast<std::size_t>(m)] = std::cos(2 * std::numbers::pi * turns);
      sines[static_cast<std::size_t>(m)] = std::sin(2 * std::numbers::pi * turns);
    }
    for (int l = 0; l <= order; ++l) {
      const double factor = zonalFactor(l, f[static_cast<std::size_t>(l)]);
      for (int m = 0; m <= l; ++m) {
        const double value = factor * first[shIndex(l, m)];
        values[shIndex(l, m)] = static_cast<float>(value * cosines[static_cast<std::size_t>(m)]);
        if (m > 0) values[shIndex(l, -m)] = static_cast<float>(value * sines[static_cast<std::size_t>(m)]);
      }
    }
    const std::size_t start = (static_cast<std::size_t>(row) * columns + column) * count;
    if (data.lobes.precision == ShPrecision::f32) {
      std::copy(values.begin(), values.end(), data.floats.begin() + static_cast<std::ptrdiff_t>(start));
    } else {
      for (std::size_t k = 0; k < count; ++k) data.halves[start + k] = floatToHalf(values[k]);
    }
  }
}

}  // namespace

ShLobes ShLobesData::view() const {
  ShLobes result = lobes;
  result.zonal = zonal;
  result.coefficients = lobes.precision == ShPrecision::f16 ? static_cast<const void*>(halves.data()) : floats.data();
  return result;
}

std::vector<double> zonalLobe(double sigma_r, int order) {
  requireOrder(order);
  if (!(sigma_r > 0 && sigma_r <= 1))
    throw Error(ErrorCode::usage, "sh.sigma_r", {}, {}, "the roughness " + fmt::format("{}", sigma_r) + " is not in (0, 1]");
  const double reach = kLobeReachSigmas * sigma_r < 1 ? std::asin(kLobeReachSigmas * sigma_r) : std::numbers::pi / 2;
  const int panels = 8 + static_cast<int>(order * reach / kPanelPhase);
  std::vector<double> f(static_cast<std::size_t>(order) + 1);
  for (int panel = 0; panel < panels; ++panel) {
    const GaussLegendre rule = gaussLegendre(kPanelNodes, reach * panel / panels, reach * (panel + 1) / panels);
    for (int k = 0; k < kPanelNodes; ++k) {
      const double sine = std::sin(rule.nodes[static_cast<std::size_t>(k)]);
      const double z = std::cos(rule.nodes[static_cast<std::size_t>(k)]);
      const double lobe = std::exp(-0.5 * sine * sine / (sigma_r * sigma_r)) / (2 * std::numbers::pi * sigma_r * sigma_r);
      const double weight = 2 * std::numbers::pi * lobe * sine * rule.weights[static_cast<std::size_t>(k)];
      double value = 1, before = 0;
      for (int l = 0; l <= order; ++l) {
        f[static_cast<std::size_t>(l)] += weight * value;
        const double next = ((2 * l + 1) * z * value - l * before) / (l + 1);
        before = value;
        value = next;
      }
    }
  }
  for (int l = 0; l <= order; ++l) f[static_cast<std::size_t>(l)] *= std::sqrt((2 * l + 1) / (4 * std::numbers::pi));
  return f;
}

void requireUsableGrid(const ShGrid& grid) {
  if (grid.rows == 0 && grid.columns == 0) return;
  if (grid.rows >= 2 && grid.rows <= 4096 && grid.columns >= 3 && grid.columns <= 8192) return;
  throw Error(ErrorCode::usage, "sh.grid", {}, {},
              "a grid of " + std::to_string(grid.rows) + " x " + std::to_string(grid.columns) + " directions cannot be used",
              "give 2 to 4096 rows and 3 to 8192 columns, such as 17x32");
}

void requireTableFits(int order, double bytes_per_coefficient, std::uint64_t max_bytes) {
  const double bytes = static_cast<double>(shCount(order)) * bytes_per_coefficient;
  if (bytes <= static_cast<double>(max_bytes)) return;
  const int fits = static_cast<int>(std::sqrt(static_cast<double>(max_bytes) / bytes_per_coefficient)) - 1;
  char what[160];
  std::snprintf(what, sizeof what, "a table of order %d needs %.3g GB, more than the limit of %.3g GB", order, bytes / 1e9,
                static_cast<double>(max_bytes) / 1e9);
  throw Error(ErrorCode::failed, "memory.limit", {}, "order", what,
              (fits >= 0 ? "order " + std::to_string(fits) + " fits; " : std::string()) +
                  "ask for a smaller grid or order, or raise --max-memory where the machine has more");
}

ShLobesData buildShLobes(const ShLobesOptions& options, const ProgressFn& progress) {
  requireUsableGrid(options.grid);
  const std::vector<double> f = zonalLobe(options.sigma_r, options.order);
  const std::size_t coefficients = options.grid.directionCount() * shCount(options.order);
  const bool half = options.precision == ShPrecision::f16;
  requireTableFits(options.order, static_cast<double>(options.grid.directionCount()) * (half ? 2 : 4), options.max_bytes);

  ShLobesData data;
  data.lobes.order = options.order;
  data.lobes.sigma_r = options.sigma_r;
  data.lobes.grid = options.grid;
  data.lobes.precision = options.precision;
  data.zonal.assign(f.begin(), f.end());
  (half ? data.halves.resize(coefficients) : data.floats.resize(coefficients));
  std::vector<double> memory(ShRecurrence<double>::size(options.order));
  const ShRecurrence<double> recurrence(options.order, memory);
  ProgressCounter counter(progress, static_cast<std::size_t>(options.grid.rows));
  tbb::parallel_for(0, options.grid.rows, [&](int row) {
    fillRow(row, f, recurrence, data);
    counter.advance();
  });
  return data;
}

}  // namespace glint::bake
