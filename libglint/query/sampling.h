#pragma once

#include <algorithm>
#include <cmath>
#include <cstdint>

#include "glint/model/ndf_pyramid.h"
#include "glint/query/bits.h"
#include "glint/query/float4.h"
#include "glint/query/ndf_model.h"
#include "glint/query/pyramid_slices.h"

namespace glint {

/// Brings a random number into [0, 1); what is not a number becomes 0.
inline GLINT_HD float clampUnit(float xi) { return xi > 0 ? std::min(xi, 0x1.fffffep-1f) : 0.0f; }
inline GLINT_HD Vec2 clampUnit(Vec2 xi) { return {clampUnit(xi.x), clampUnit(xi.y)}; }

/// Chooses one of `count` things in proportion to weight(k) >= 0, which sum to `total`, and leaves in `xi` how far into the share of
/// the chosen one it fell: again uniform in [0, 1), so that one number serves a chain of choices and stratified numbers stay so.
/// @return index, or -1 if no weight is positive
template <class Weight>
GLINT_HD int chooseIndex(int count, float total, Weight&& weight, float& xi) {
  float rest = xi * total;
  int chosen = -1;
  float share = 1;
  for (int k = 0; k < count; ++k) {
    const float w = weight(k);
    if (!(w > 0)) continue;
    if (chosen >= 0) rest -= share;
    chosen = k;
    share = w;
    if (rest < w) break;
  }
  xi = clampUnit(rest / share);
  return chosen;
}

/// A block of one image: its number b = by * blocksPerAxis + bx, and its rank among the blocks that the image stores.
struct BlockChoice {
  int block = -1;  ///< -1: nothing to choose
  int rank = 0;
};

/// The bits of one row of blocks in an image's mask.
inline GLINT_HD std::uint64_t blockRowBits(const std::uint64_t* mask, int blocks_per_axis, int row) {
  const int first = row * blocks_per_axis, word = first / 64, shift = first % 64;
  std::uint64_t bits = mask[word] >> shift;
  if (shift + blocks_per_axis > 64) bits |= mask[word + 1] << (64 - shift);
  return blocks_per_axis == 64 ? bits : bits & ((std::uint64_t{1} << blocks_per_axis) - 1);
}

/// Chooses a stored block: its row with xi.y, its column with xi.x. What is left of `xi` serves the next choice.
/// @param mask   stored blocks, one bit each
/// @param total  mass of the image
/// @param mass   mass(begin, end): of the stored blocks of these ranks
template <class Mass>
GLINT_HD BlockChoice chooseBlock(const std::uint64_t* mask, int blocks_per_axis, float total, Mass&& mass, Vec2& xi) {
  int begin = 0, chosen_begin = 0, chosen_row = -1;
  std::uint64_t chosen_bits = 0;
  float share = 1, rest = xi.y * total;
  for (int row = 0; row < blocks_per_axis; ++row) {
    const std::uint64_t bits = blockRowBits(mask, blocks_per_axis, row);
    if (bits == 0) continue;
    const int end = begin + setBits(bits);
    const float w = mass(begin, end);
    if (w > 0) {
      if (chosen_row >= 0) rest -= share;
      chosen_row = row;
      chosen_bits = bits;
      chosen_begin = begin;
      share = w;
      if (rest < w) break;
    }
    begin = end;
  }
  if (chosen_row < 0) return {};
  xi.y = clampUnit(rest / share);
  const int k = std::max(
      chooseIndex(setBits(chosen_bits), share, [&](int j) { return mass(chosen_begin + j, chosen_begin + j + 1); }, xi.x), 0);
  for (int j = 0; j < k; ++j) chosen_bits &= chosen_bits - 1;
  return {chosen_row * blocks_per_axis + lowestBit(chosen_bits), chosen_begin + k};
}

/// The sums that a choice among the pixels of a block needs.
struct BlockSums {
  float rows[kBlockSize];
  float total = 0;
};

inline GLINT_HD BlockSums sumRows(const float* pixels) {
  BlockSums sums;
  for (int y = 0; y < kBlockSize; ++y) {
    const float* row = pixels + y * kBlockSize;
    const Float4 four = (Float4::load(row) + Float4::load(row + 4)) + (Float4::load(row + 8) + Float4::load(row + 12));
    sums.rows[y] = four.sum();
    sums.total += sums.rows[y];
  }
  return sums;
}

/// Chooses a pixel in proportion to its value: its row with xi.y, its column with xi.x.
/// @param pixels  [16][16], >= 0
/// @return x = -1 if all are 0
inline GLINT_HD PixelPlace choosePixel(const float* pixels, const BlockSums& sums, int block, Vec2& xi) {
  const int y = chooseIndex(kBlockSize, sums.total, [&](int k) { return sums.rows[k]; }, xi.y);
  if (y < 0) return {block, -1, -1};
  const float* row = pixels + y * kBlockSize;
  return {block, chooseIndex(kBlockSize, sums.rows[y], [&](int k) { return row[k]; }, xi.x), y};
}

/// The half vector at position `xi` of a pixel. Kept 2^-23 resolution from the pixel's border, so that rounding does not take it
/// into a neighbour.
inline GLINT_HD Vec2 pointInPixel(const PyramidShape& shape, const PixelPlace& place, Vec2 xi) {
  const float margin = 0x1p-23f * static_cast<float>(shape.resolution);
  const int blocks = shape.blocksPerAxis();
  const auto coordinate = [&](int pixel, float t) {
    const float inside = margin + (1 - 2 * margin) * t;
    return (static_cast<float>(pixel - shape.resolution / 2) + inside) * (2 / static_cast<float>(shape.resolution));
  };
  return {coordinate(place.block % blocks * kBlockSize + place.x, xi.x),
          coordinate(place.block / blocks * kBlockSize + place.y, xi.y)};
}

}  // namespace glint
