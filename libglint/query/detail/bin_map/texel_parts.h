#pragma once

#include <algorithm>
#include <cstdint>

#include "glint/math/lanes.h"
#include "glint/model/bin_map.h"
#include "glint/query/detail/bin_map/facet_lobe.h"
#include "glint/query/detail/bin_map/texel_filter.h"

namespace glint {

/// Weights of texels in the first and the last column (or row) of a range. Texels between have weight 1. A footprint covers its
/// first and last column only in part.
struct RangeEnds {
  float low = 1, high = 1;  ///< equal where the range has one column (or row)
};

/// Weights of texels by one field of their codes, column or row. Fields are compared without shifting them down.
struct PartRange {
  /// @param shift, bits  position and width of the field; shift < 32
  GLINT_HD PartRange(int shift, int bits, IndexRange range, RangeEnds ends) : at(ends) {
    const int largest = static_cast<int>((1u << bits) - 1);
    const int first = std::max(range.low, 0), last = std::min(range.high, largest);
    mask = static_cast<std::uint32_t>(largest) << shift;
    if (first <= last) {
      begin = static_cast<std::uint32_t>(first) << shift;
      span = static_cast<std::uint32_t>(last - first) << shift;
    }
    if (range.low == first) low = begin;
    if (range.high == last) high = begin + span;
  }
  GLINT_HD float part(std::uint32_t texel) const {
    const std::uint32_t value = texel & mask;
    if (value - begin > span) return 0;
    return value == low ? at.low : value == high ? at.high : 1;
  }

  static constexpr std::uint32_t kNever = ~std::uint32_t{0};  ///< equal to no field, since no field has all bits of a code
  std::uint32_t mask;
  std::uint32_t begin = kNever, span = 0;     ///< the range: fields from begin to begin + span have a weight above 0
  std::uint32_t low = kNever, high = kNever;  ///< ends of the range; kNever where the cell does not contain them
  RangeEnds at;
};

/// Weights of texels by column and row: the covered area under a footprint with sides along the axes.
struct TexelParts {
  /// @tparam kCut  the fields of TexelFilter that matter
  template <unsigned kCut>
  GLINT_HD float of(std::uint32_t texel) const {
    float product = 1;
    if constexpr ((kCut & TexelFilter::kColumn) != 0) product *= columns.part(texel);
    if constexpr ((kCut & TexelFilter::kRow) != 0) product *= rows.part(texel);
    return product;
  }
  PartRange columns, rows;
};

/// Computes the slot of a texel in a window of kSide x kSide bins. The block of the texel may have several bins, so the code
/// tells the bin.
struct SlotFields {
  static constexpr std::uint32_t kSide = 5, kNone = kSide * kSide;

  GLINT_HD std::uint32_t slotOf(std::uint32_t texel) const {
    const std::uint32_t x = (texel >> shift_x & mask) + first_x, y = (texel >> shift_y & mask) + first_y;
    return x < kSide && y < kSide ? y * kSide + x : kNone;
  }

  int shift_x, shift_y;            ///< position of the bin's column and row in a code
  std::uint32_t mask;              ///< bins of the block along each axis, minus 1
  std::uint32_t first_x, first_y;  ///< the window's column and row of the block's first bin; modulo 2^32
};

/// Texels in a window: their slots and weights.
struct FoundTexels {
  static constexpr int kMost = 256;
  int count = 0;
  std::uint32_t slots[kMost + 8];  // a group of texels is stored whole
  float parts[kMost + 8];
};

/// Sums over the texels of a block: weights, and weights times the first and second powers of (x, y). (x, y) is the position of
/// the normal from the middle of the block, in sub-bins.
struct SubbinMoments {
  double weight = 0, x = 0, y = 0, xx = 0, xy = 0, yy = 0;

  /// Adds other sums, multiplied by `times`.
  GLINT_HD void add(double times, const SubbinMoments& other) {
    weight += times * other.weight, x += times * other.x, y += times * other.y;
    xx += times * other.xx, xy += times * other.xy, yy += times * other.yy;
  }
};

/// Reads the positions of normals in their block from codes.
struct SubbinFields {
  GLINT_HD explicit SubbinFields(const TexelCode& code)
      : shift_x(std::min(code.column_bits + code.row_bits, 31)),
        shift_y(std::min(code.column_bits + code.row_bits + code.subbin_bits, 31)),
        mask((1u << code.subbin_bits) - 1),
        middle(0.5f * static_cast<float>(mask)) {}
  GLINT_HD float x(std::uint32_t texel) const { return static_cast<float>(static_cast<int>(texel >> shift_x & mask)) - middle; }
  GLINT_HD float y(std::uint32_t texel) const { return static_cast<float>(static_cast<int>(texel >> shift_y & mask)) - middle; }

  int shift_x, shift_y;
  std::uint32_t mask;
  float middle;  ///< middle of the block, in units of the field
};

/// The lobes of texels (FacetLobe) at one half vector, without their common factor. Positions are those of SubbinFields.
struct SubbinLobe {
  float x, y;      ///< the half vector
  float exponent;  ///< half the square of a sub-bin over the variance of the lobe

  /// @tparam V  Lanes1 or Lanes8: positions of one normal or of eight
  template <class V>
  GLINT_LANE V at(const V& normal_x, const V& normal_y) const {
    const V dx = normal_x - V::all(x), dy = normal_y - V::all(y);
    return upperOf(decayOf(V::all(exponent) * (dx * dx + dy * dy)) - V::all(FacetLobe::kEnd), V::all(0));
  }
};

/// Reads lists one texel after the other. Avx2Texels does the same eight at a time.
struct SingleTexels {
  using Parts = TexelParts;

  /// Appends the texels of a list that are in the window. `found` must have room for all `count`.
  template <unsigned kCut>
  static GLINT_HD void find(const std::uint32_t* texels, int count, const Parts& parts, const SlotFields& fields,
                            FoundTexels& found) {
    for (int k = 0; k < count; ++k) {
      const std::uint32_t slot = fields.slotOf(texels[k]);
      found.slots[found.count] = slot;
      found.parts[found.count] = parts.of<kCut>(texels[k]);
      found.count += slot != SlotFields::kNone ? 1 : 0;
    }
  }

  /// Sum of the weights of a list. Adds in eight sums, texel k to sum k % 8, as vectors of eight do.
  template <unsigned kCut>
  static GLINT_HD float sum(const std::uint32_t* texels, int count, const Parts& parts) {
    float sums[8] = {};
    for (int k = 0; k < count; ++k) sums[k % 8] += parts.of<kCut>(texels[k]);
    return total(sums);
  }

  /// Moments of a list, added in eight sums like `sum`.
  template <unsigned kCut>
  static GLINT_HD SubbinMoments moments(const std::uint32_t* texels, int count, const Parts& parts,
                                        const SubbinFields& fields) {
    float sums[6][8] = {};
    for (int k = 0; k < count; ++k) {
      const float w = parts.of<kCut>(texels[k]), x = fields.x(texels[k]), y = fields.y(texels[k]), wx = w * x, wy = w * y;
      const float values[6] = {w, wx, wy, wx * x, wx * y, wy * y};
      for (int i = 0; i < 6; ++i) sums[i][k % 8] += values[i];
    }
    return {total(sums[0]), total(sums[1]), total(sums[2]), total(sums[3]), total(sums[4]), total(sums[5])};
  }

  /// Sum of the weights of a list times the lobes at a half vector, added in eight sums like `sum`.
  template <unsigned kCut>
  static GLINT_HD float lobes(const std::uint32_t* texels, int count, const Parts& parts, const SubbinFields& fields,
                              const SubbinLobe& lobe) {
    float sums[8] = {};
    for (int k = 0; k < count; ++k)
      sums[k % 8] += parts.of<kCut>(texels[k]) * lobe.at(Lanes1{fields.x(texels[k])}, Lanes1{fields.y(texels[k])}).v;
    return total(sums);
  }

 private:
  static GLINT_HD float total(float (&sums)[8]) {
    for (int half = 4; half > 0; half /= 2)
      for (int k = 0; k < half; ++k) sums[k] += sums[k + half];
    return sums[0];
  }
};

}  // namespace glint
