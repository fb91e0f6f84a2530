#pragma once

// Arrays as Python hands them over, and as the C interface reads them.

#include <nanobind/nanobind.h>
#include <nanobind/ndarray.h>

#include <cstddef>

#include "glint.h"

namespace glint::python {

namespace nb = nanobind;

/// Numbers of queries: [queries][members], of any strides. A stride of 0 gives all queries the same number.
using Rows = nb::ndarray<const float, nb::ndim<2>, nb::device::cpu>;
using DoubleRows = nb::ndarray<const double, nb::ndim<2>, nb::device::cpu>;
/// Memory for answers: [queries][members].
using Answers = nb::ndarray<float, nb::ndim<2>, nb::c_contig, nb::device::cpu>;

/// One member of all queries from query number `first` on.
inline glint_floats member(const Rows& rows, std::size_t index, std::size_t first) {
  const auto element = static_cast<std::ptrdiff_t>(sizeof(float));
  return {
      rows.data() + static_cast<std::ptrdiff_t>(index) * rows.stride(1) + static_cast<std::ptrdiff_t>(first) * rows.stride(0),
      rows.stride(0) * element};
}

inline glint_doubles member(const DoubleRows& rows, std::size_t index, std::size_t first) {
  const auto element = static_cast<std::ptrdiff_t>(sizeof(double));
  return {
      rows.data() + static_cast<std::ptrdiff_t>(index) * rows.stride(1) + static_cast<std::ptrdiff_t>(first) * rows.stride(0),
      rows.stride(0) * element};
}

inline glint_directions directions(const Rows& rows, std::size_t first) {
  return {member(rows, 0, first), member(rows, 1, first), member(rows, 2, first)};
}

/// Answers from query number `first` on.
inline float* from(const Answers& answers, std::size_t first) { return answers.data() + first * answers.shape(1); }

}  // namespace glint::python
