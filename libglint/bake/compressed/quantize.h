#pragma once

#include <cstdint>

namespace glint::bake {

/// Largest integers of wide (8 bits) and of narrow (4 bits) coefficients.
inline constexpr float kWidePeak = 127;
inline constexpr float kNarrowPeak = 7;

/// Squared errors of the coefficients of one column, summed.
struct ColumnErrors {
  double energy = 0;  ///< error without the column
  double narrow = 0;  ///< error with 4 bits
  double wide = 0;    ///< error with 8 bits
};

/// Errors of a column when its coefficients are rounded to the best steps.
/// @param coefficients  [count]
/// @param weights       [count]: weights of squared errors
ColumnErrors roundingErrors(const float* coefficients, const float* weights, int count);

/// Step of 4-bit coefficients with the smallest error. Where most coefficients are small, a small step that cuts large
/// coefficients off is better than a step that reaches them.
/// @param stride  floats between coefficients
float narrowStep(const float* coefficients, int count, int stride);

/// The code (see blockMassCode) whose mass is nearest.
std::uint8_t nearestMassCode(float mass);

}  // namespace glint::bake
