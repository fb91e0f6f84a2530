#pragma once

namespace glint::bake {

/// Largest coefficients of wide and of narrow columns.
inline constexpr float kWidePeak = 127;
inline constexpr float kNarrowPeak = 7;

/// Squared errors of one column, summed over its coefficients.
struct ColumnErrors {
  double energy = 0;  ///< without the column
  double narrow = 0;  ///< with 4 bits
  double wide = 0;    ///< with 8 bits
};

/// Rounding of a column's coefficients to the steps that leave least.
ColumnErrors roundingErrors(const float* coefficients, int count);

/// Step of 4-bit coefficients that leaves the smallest error: large ones are cut where most are small.
/// @param stride  floats between coefficients
float narrowStep(const float* coefficients, int count, int stride);

}  // namespace glint::bake
