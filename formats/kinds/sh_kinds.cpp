#include <algorithm>
#include <cmath>

#include "glint/formats/kinds/codec.h"
#include "glint/formats/kinds/pyramid_shape.h"
#include "glint/formats/number_text.h"
#include "glint/math/half.h"

namespace glint::formats {
namespace {

/// Half precision keeps a coefficient to 2^-11 and drops what is below 2^-25 of the largest.
constexpr double kNormTolerance = 1e-2;

ElementType elementType(ShPrecision precision) { return precision == ShPrecision::f16 ? ElementType::f16 : ElementType::f32; }

std::uint64_t coefficientCount(const ShGrid& grid, int order) { return grid.directionCount() * shCount(order); }

void packShape(int order, const ShGrid& grid, ShPrecision precision, PackedAsset& packed) {
  packed.integer("order", order);
  packed.integer("grid_rows", grid.rows);
  packed.integer("grid_columns", grid.columns);
  packed.text("precision", precision == ShPrecision::f16 ? "f16" : "f32");
}

ShGrid unpackGrid(const Content& content) { return {content.integer("grid_rows"), content.integer("grid_columns")}; }

ShPrecision unpackPrecision(const Content& content) {
  return content.is("precision", "f16") ? ShPrecision::f16 : ShPrecision::f32;
}

void checkGrid(const ShGrid& grid, bool may_be_empty, Findings& findings) {
  if (grid.rows >= 2 && grid.columns >= 3) return;
  if (may_be_empty && grid.rows == 0 && grid.columns == 0) return;
  findings.add("sh.grid", "/@grid_rows",
               "is a grid of " + std::to_string(grid.rows) + " x " + std::to_string(grid.columns) + " directions");
}

double coefficient(const void* coefficients, ShPrecision precision, std::size_t index) {
  if (precision == ShPrecision::f32) return static_cast<const float*>(coefficients)[index];
  return ieeeHalfToFloat(static_cast<const std::uint16_t*>(coefficients)[index]);
}

/// Reports numbers that are not finite, or negative where `signed_values` is false.
void checkValues(std::span<const float> values, bool signed_values, const char* object, Findings& findings) {
  for (std::size_t k = 0; k < values.size(); ++k) {
    if (std::isfinite(values[k]) && (signed_values || values[k] >= 0)) continue;
    findings.add("sh.finite", object, "element " + std::to_string(k) + " is " + numberText(values[k]));
    return;
  }
}

/// Norm of one band of one function; not finite if a coefficient is not.
double bandNorm(const void* coefficients, ShPrecision precision, std::size_t start, int l) {
  double sum = 0;
  for (int k = 0; k <= 2 * l; ++k) {
    const double c = coefficient(coefficients, precision, start + shIndex(l, 0) + static_cast<std::size_t>(k));
    sum += c * c;
  }
  return std::sqrt(sum);
}

}  // namespace

PackedAsset pack(const ShLobes& lobes) {
  PackedAsset packed{"sh-lobes", {}, {}};
  packShape(lobes.order, lobes.grid, lobes.precision, packed);
  packed.real("sigma_r", lobes.sigma_r);
  const auto order = static_cast<std::uint64_t>(lobes.order);
  packed.array("zonal", ElementType::f32, {order + 1}, lobes.zonal.data(), lobes.zonal.size());
  packed.array(
      "lobes", elementType(lobes.precision),
      {static_cast<std::uint64_t>(lobes.grid.rows), static_cast<std::uint64_t>(lobes.grid.columns), shCount(lobes.order)},
      lobes.coefficients, coefficientCount(lobes.grid, lobes.order));
  return packed;
}

PackedAsset pack(const ShLight& light) {
  PackedAsset packed{"sh-light", {}, {}};
  packShape(light.order, light.grid, light.precision, packed);
  const auto rows = static_cast<std::uint64_t>(light.grid.rows), columns = static_cast<std::uint64_t>(light.grid.columns);
  const auto order = static_cast<std::uint64_t>(light.order);
  packed.array("scales", ElementType::f32, {rows, columns}, light.scales.data(), light.scales.size());
  packed.array("band_norms", ElementType::f32, {rows, columns, order + 1}, light.band_norms.data(), light.band_norms.size());
  packed.array("light", elementType(light.precision), {rows, columns, 3, shCount(light.order)}, light.coefficients,
               3 * coefficientCount(light.grid, light.order));
  return packed;
}

void unpack(const Content& content, ShLobes& lobes) {
  lobes.order = content.integer("order");
  lobes.sigma_r = content.real("sigma_r");
  lobes.grid = unpackGrid(content);
  lobes.precision = unpackPrecision(content);
  lobes.zonal = content.array<float>("zonal");
  lobes.coefficients = content.dataset("lobes").data;
}

void unpack(const Content& content, ShLight& light) {
  light.order = content.integer("order");
  light.grid = unpackGrid(content);
  light.precision = unpackPrecision(content);
  light.scales = content.array<float>("scales");
  light.band_norms = content.array<float>("band_norms");
  light.coefficients = content.dataset("light").data;
}

void checkIndex(const ShLobes& lobes, Findings& findings) { checkGrid(lobes.grid, true, findings); }

void checkIndex(const ShLight& light, Findings& findings) { checkGrid(light.grid, false, findings); }

void checkData(const ShLobes& lobes, Findings& findings) {
  checkValues(lobes.zonal, true, "/zonal", findings);
  const std::size_t count = shCount(lobes.order);
  double norm = 0;
  for (const float f : lobes.zonal) norm += double{f} * f;
  std::size_t other = 0, first = 0;
  for (std::size_t d = 0; d < lobes.grid.directionCount(); ++d) {
    double turned = 0;
    for (int l = 0; l <= lobes.order; ++l) turned += std::pow(bandNorm(lobes.coefficients, lobes.precision, d * count, l), 2);
    if (!std::isfinite(turned)) {
      findings.add("sh.finite", "/lobes", "direction " + std::to_string(d) + " has coefficients that are not finite");
      return;
    }
    if (!(std::fabs(std::sqrt(turned) - std::sqrt(norm)) <= kNormTolerance * std::sqrt(norm)) && other++ == 0) first = d;
  }
  if (other > 0)
    findings.add("sh.zonal", "/lobes",
                 std::to_string(other) + " lobes have another norm than the one along +z (first at direction " +
                     std::to_string(first) + ")");
}

void checkData(const ShLight& light, Findings& findings) {
  checkValues(light.scales, false, "/scales", findings);
  checkValues(light.band_norms, false, "/band_norms", findings);
  const std::size_t count = shCount(light.order), bands = static_cast<std::size_t>(light.order) + 1;
  std::size_t other = 0, first = 0;
  for (std::size_t d = 0; d < light.grid.directionCount(); ++d) {
    double largest = 0;
    for (std::size_t l = 0; l < bands; ++l) largest = std::max(largest, double{light.band_norms[d * bands + l]});
    bool holds = true;
    for (int l = 0; l <= light.order; ++l) {
      double norm = 0;
      for (std::size_t c = 0; c < 3; ++c) {
        const double channel = bandNorm(light.coefficients, light.precision, (d * 3 + c) * count, l);
        if (!std::isfinite(channel)) {
          findings.add("sh.finite", "/light", "direction " + std::to_string(d) + " has coefficients that are not finite");
          return;
        }
        norm = std::max(norm, channel * light.scales[d]);
      }
      const double stored = light.band_norms[d * bands + static_cast<std::size_t>(l)];
      // Small bands lose digits to the largest coefficient's scale in half precision.
      holds &= std::fabs(norm - stored) <= kNormTolerance * stored + 1e-5 * largest;
    }
    if (!holds && other++ == 0) first = d;
  }
  if (other > 0)
    findings.add(
        "sh.band_norms", "/band_norms",
        "differs from the coefficients at " + std::to_string(other) + " directions (first " + std::to_string(first) + ")");
}

}  // namespace glint::formats
