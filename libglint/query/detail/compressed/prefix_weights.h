#pragma once

#include <cstddef>

#include "glint/math/float4.h"
#include "glint/model/ndf_pyramid.h"

// Weighted sums of columns of prefix sums, for 16 pixels at once: the step that rows of pixels of every method need.

namespace glint {

/// Reads prefix sums as they are stored.
struct Stored {
  template <class Element>
  GLINT_HD Float4 four(const Element* at) const {
    return Float4::load(at);
  }
};
/// Reads prefix sums less the prefix sums that lie `above` elements before.
struct LessAbove {
  template <class Element>
  GLINT_HD Float4 four(const Element* at) const {
    return Float4::difference(at, at - above, -1);
  }
  std::ptrdiff_t above;
};

/// Weights of columns in groups of eight. A last group overlaps the group before it where the number of columns is no multiple
/// of eight.
struct ColumnWeights {
  const float* weights;  ///< [whole]
  int whole;             ///< columns in whole groups
  const float* last;     ///< weights of columns last_at to last_at + 7; nullptr: there is no such group
  int last_at;
  int counted;  ///< columns at the begin of the last group that another group counts already
};

/// Weighted sums of the columns of eight rows. Each sum has eight lanes until the end, held as two groups of four.
struct EightRows {
  /// @param load  Stored or LessAbove
  template <class Element, class Load>
  GLINT_HD void operator()(const Element* prefix, int stride, const ColumnWeights& columns, Load load, Float4* sums) const {
    for (int k = 0; k < 2; ++k) sums[k] = four(prefix + 4 * k * stride, stride, columns, load);
  }

 private:
  template <class Element, class Load>
  static GLINT_HD Float4 four(const Element* prefix, int stride, const ColumnWeights& columns, Load load) {
    Float4 low[4] = {Float4::zero(), Float4::zero(), Float4::zero(), Float4::zero()},
           high[4] = {low[0], low[0], low[0], low[0]};
    const auto add = [&](Float4 w0, Float4 w1, const Element* at) {
      for (int j = 0; j < 4; ++j) {
        low[j] = low[j] + w0 * load.four(at + j * stride);
        high[j] = high[j] + w1 * load.four(at + j * stride + 4);
      }
    };
    if (columns.last != nullptr) {
      const Float4 counted = Float4::all(static_cast<float>(columns.counted) - 0.5f);
      add(whereLess(counted, Float4::of(0, 1, 2, 3), Float4::load(columns.last)),
          whereLess(counted, Float4::of(4, 5, 6, 7), Float4::load(columns.last + 4)), prefix + columns.last_at);
    }
    for (int k = 0; k < columns.whole; k += 8)
      add(Float4::load(columns.weights + k), Float4::load(columns.weights + k + 4), prefix + k);
    return sumsOf(low[0] + high[0], low[1] + high[1], low[2] + high[2], low[3] + high[3]);
  }
};

/// weighPrefixes for one to three columns.
template <class Element, class Load>
GLINT_HD Float16 weighFewPrefixes(const Element* prefix, int stride, int columns, const float* weights, Load load) {
  float w[3] = {};
  for (int k = 0; k < columns; ++k) w[k] = weights[k];
  const Float4 head = Float4::of(w[0], w[1], w[2], 0);
  const Float4 tail = columns == 1   ? Float4::of(0, 0, 0, w[0])
                      : columns == 2 ? Float4::of(0, 0, w[0], w[1])
                                     : Float4::of(0, w[0], w[1], w[2]);
  const auto four = [&](const Element* at, Float4 each) {
    return sumsOf(each * load.four(at), each * load.four(at + stride), each * load.four(at + 2 * stride),
                  each * load.four(at + 3 * stride));
  };
  // Groups of four reach beyond a row of the block: at the first rows to the right, at the last rows to the left. So nothing
  // outside the block is read.
  return {{four(prefix, head), four(prefix + 4 * stride, head), four(prefix + 8 * stride, head),
           four(prefix + 12 * stride + columns - 4, tail)}};
}

/// Lane t: sum over k of weights[k] * prefix[t * stride + k].
/// @param load        Stored or LessAbove
/// @param eight_rows  EightRows, or a function with the same results
template <class Element, class Load, class Rows>
GLINT_HD Float16 weighPrefixes(const Element* prefix, int stride, int columns, const float* weights, Load load,
                               Rows eight_rows) {
  if (columns < 4) return weighFewPrefixes(prefix, stride, columns, weights, load);
  Float16 sums;
  const Element* last_rows = prefix + kBlockSize / 2 * stride;
  if (columns < 8) {  // As in weighFewPrefixes, groups reach beyond a row and not beyond the block.
    float first[8] = {}, last[8] = {};
    for (int k = 0; k < columns; ++k) first[k] = last[8 - columns + k] = weights[k];
    eight_rows(prefix, stride, ColumnWeights{weights, 0, first, 0, 0}, load, sums.v);
    eight_rows(last_rows, stride, ColumnWeights{weights, 0, last, columns - 8, 0}, load, sums.v + 2);
    return sums;
  }
  const int rest = columns % 8, last_at = columns - 8;
  const ColumnWeights all = {weights, columns - rest, rest > 0 ? weights + last_at : nullptr, last_at, 8 - rest};
  eight_rows(prefix, stride, all, load, sums.v);
  eight_rows(last_rows, stride, all, load, sums.v + 2);
  return sums;
}

/// weighPrefixes with vectors of four, as a function object. Bases take such an object, so that another one can use wider
/// vectors.
struct WeighPrefixes {
  template <class Element, class Load>
  GLINT_DEVICE_CALL GLINT_HD Float16 operator()(const Element* prefix, int stride, int columns, const float* weights,
                                                Load load) const {
    return weighPrefixes(prefix, stride, columns, weights, load, EightRows());
  }
};

}  // namespace glint
