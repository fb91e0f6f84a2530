#pragma once

// Private to formats/: what the kinds of spherical harmonics share.

#include <cstddef>
#include <span>
#include <string>

#include "glint/formats/findings.h"
#include "glint/formats/kinds/shared_fields.h"
#include "glint/formats/kinds/tally.h"
#include "glint/model/sh.h"

namespace glint::formats {

/// Half precision keeps a coefficient to 2^-11 and drops coefficients below 2^-25 of the largest.
inline constexpr double kShNormTolerance = 1e-2;

/// Order, grid and precision.
/// @param smallest_grid  rows and columns that a grid has at least
void describeSh(Fields auto& fields, auto& asset, double smallest_grid) {
  fields.integer("order", asset.order, {0, kMaxShOrder}, "1", "highest band of the spherical harmonics");
  fields.integer("grid_rows", asset.grid.rows, {smallest_grid, 4096}, "1",
                 "polar angles of the grid of directions, both poles included");
  fields.integer("grid_columns", asset.grid.columns, {smallest_grid, 8192}, "1", "azimuths of the grid of directions");
  fields.choice("precision", asset.precision, "f16|f32", "type of the stored coefficients");
}

void describeCoefficients(Fields auto& fields, std::string_view path, auto& coefficients, std::uint64_t count, Dims dims,
                          std::string_view long_name) {
  const Types types = {{"precision=f16", ElementType::f16}, {"precision=f32", ElementType::f32}};
  fields.data(path, coefficients, std::uint64_t{count}, types, dims, "1", long_name);
}

/// "at direction 3", for report().
inline std::string directionName(std::size_t direction) { return "at direction " + std::to_string(direction); }

void checkGrid(const ShGrid& grid, bool may_be_empty, Findings& findings);

/// Reports numbers that are not finite, or negative where `signed_values` is false.
void checkShNumbers(std::span<const float> values, bool signed_values, const char* object, Findings& findings);

/// Norm of one band of one function; not finite if a coefficient is not.
/// @param start  number of the function's first coefficient
double bandNorm(const void* coefficients, ShPrecision precision, std::size_t start, int l);

}  // namespace glint::formats
