#include "glint/formats/kinds/sh_fields.h"

#include <cmath>

#include "glint/formats/number_text.h"
#include "glint/math/half.h"

namespace glint::formats {
namespace {

double coefficient(const void* coefficients, ShPrecision precision, std::size_t index) {
  if (precision == ShPrecision::f32) return static_cast<const float*>(coefficients)[index];
  return ieeeHalfToFloat(static_cast<const std::uint16_t*>(coefficients)[index]);
}

}  // namespace

void checkGrid(const ShGrid& grid, bool may_be_empty, Findings& findings) {
  if (grid.rows >= 2 && grid.columns >= 3) return;
  if (may_be_empty && grid.rows == 0 && grid.columns == 0) return;
  findings.add("sh.grid", "/@grid_rows",
               "is a grid of " + std::to_string(grid.rows) + " x " + std::to_string(grid.columns) + " directions");
}

void checkShNumbers(std::span<const float> values, bool signed_values, const char* object, Findings& findings) {
  for (std::size_t k = 0; k < values.size(); ++k) {
    if (std::isfinite(values[k]) && (signed_values || values[k] >= 0)) continue;
    findings.add("sh.finite", object, "element " + std::to_string(k) + " is " + numberText(values[k]));
    return;
  }
}

double bandNorm(const void* coefficients, ShPrecision precision, std::size_t start, int l) {
  double sum = 0;
  for (int k = 0; k <= 2 * l; ++k) {
    const double c = coefficient(coefficients, precision, start + shIndex(l, 0) + static_cast<std::size_t>(k));
    sum += c * c;
  }
  return std::sqrt(sum);
}

}  // namespace glint::formats
