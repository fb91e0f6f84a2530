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

/// The same among 16 things. Nothing branches on the weights, which cannot be predicted.
inline GLINT_HD int chooseOf16(const float* weights, float& xi) {
  float before[17];  // before[k]: of the first k
  before[0] = 0;
  Float4 sum = Float4::zero();
  for (int k = 0; k < 16; k += 4) {
    sum = sum.last() + Float4::load(weights + k).runningSums();
    sum.store(before + k + 1);
  }
  const float rest = xi * before[16];
  unsigned passed = 0;
  for (int k = 0; k < 16; k += 4) passed |= Float4::load(before + k + 1).notAbove(rest) << k;
  const int k = lowestBit(~std::uint64_t{passed});
  // The sums are rounded, so that the last one may be passed, or something without weight be met.
  if (k == 16 || !(weights[k] > 0))
    return chooseIndex(
        16, before[16], [&](int i) { return weights[i]; }, xi);
  xi = clampUnit((rest - before[k]) / weights[k]);
  return k;
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
  const int k =
      std::max(chooseIndex(
                   setBits(chosen_bits), share, [&](int j) { return mass(chosen_begin + j, chosen_begin + j + 1); }, xi.x),
               0);
  return {chosen_row * blocks_per_axis + selectBit(chosen_bits, k), chosen_begin + k};
}

/// The same for at most 16 blocks along each axis whose masses lie in an array. Nothing branches on the masses.
/// @param count  of stored blocks
inline GLINT_HD BlockChoice chooseBlockOf16(const std::uint64_t* mask, int blocks_per_axis, const float* masses, int count,
                                            Vec2& xi) {
  float sums[64 + 1];  // of the groups of four before each
  sums[0] = 0;
  const int groups = count / 4;
  for (int k = 0; k < groups; ++k) sums[k + 1] = sums[k] + Float4::load(masses + 4 * k).sum();
  const auto before = [&](int rank) {
    float sum = sums[rank / 4];
    for (int k = rank / 4 * 4; k < rank; ++k) sum += masses[k];
    return sum;
  };
  // The block at which the masses before it reach xi.y, and the row that it is in.
  const float total = before(count), rest = xi.y * total;
  int group = 0;
  for (int k = 1; k <= groups; ++k) group += sums[k] <= rest ? 1 : 0;
  int at = 4 * group;
  for (float sum = sums[group]; at < count; ++at) {
    sum += masses[at];
    if (!(sum <= rest)) break;
  }
  int row = 0, begin = 0, end = 0;
  std::uint64_t bits = 0;
  for (int k = 0, ranks = 0; k < blocks_per_axis; ++k) {
    const std::uint64_t here = blockRowBits(mask, blocks_per_axis, k);
    const int next = ranks + setBits(here);
    const bool inside = ranks <= at && at < next;
    row = inside ? k : row;
    bits = inside ? here : bits;
    begin = inside ? ranks : begin;
    end = inside ? next : end;
    ranks = next;
  }
  const float below = before(begin), share = before(end) - below;
  const auto mass = [&](int first, int last) {
    float sum = 0;
    for (int k = first; k < last; ++k) sum += masses[k];
    return sum;
  };
  if (!(share > 0)) return chooseBlock(mask, blocks_per_axis, total, mass, xi);  // after rounding
  float weights[16];
  const auto weight = [&](int k) { return begin + k < end ? masses[begin + k] : 0.0f; };
  for (int k = 0; k < 16; k += 4) Float4::of(weight(k), weight(k + 1), weight(k + 2), weight(k + 3)).store(weights + k);
  xi.y = clampUnit((rest - below) / share);
  const int k = std::max(chooseOf16(weights, xi.x), 0);
  return {row * blocks_per_axis + selectBit(bits, k), begin + k};
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

/// The same of half-precision numbers.
inline GLINT_HD BlockSums sumRows(const std::uint16_t* pixels) {
  BlockSums sums;
  for (int y = 0; y < kBlockSize; y += 4) {
    Float4 rows[4];
    for (int j = 0; j < 4; ++j) {
      const std::uint16_t* row = pixels + (y + j) * kBlockSize;
      rows[j] = (Float4::loadPositive(row) + Float4::loadPositive(row + 4)) +
                (Float4::loadPositive(row + 8) + Float4::loadPositive(row + 12));
    }
    sumsOf(rows[0], rows[1], rows[2], rows[3]).store(sums.rows + y);
  }
  for (int y = 0; y < kBlockSize; ++y) sums.total += sums.rows[y];
  return sums;
}

/// Chooses a pixel in proportion to its value: its row with xi.y, its column with xi.x.
/// @param pixels  [16][16], >= 0
/// @return x = -1 if all are 0
inline GLINT_HD PixelPlace choosePixel(const float* pixels, const BlockSums& sums, int block, Vec2& xi) {
  const int y = chooseOf16(sums.rows, xi.y);
  if (y < 0) return {block, -1, -1};
  return {block, chooseOf16(pixels + y * kBlockSize, xi.x), y};
}
static_assert(kBlockSize == 16);

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
