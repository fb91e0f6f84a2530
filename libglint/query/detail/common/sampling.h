#pragma once

#include <algorithm>
#include <cmath>
#include <cstdint>

#include "glint/math/bits.h"
#include "glint/math/float4.h"
#include "glint/math/vec.h"

namespace glint {

/// Clamps a random number to [0, 1); NaN becomes 0.
inline GLINT_HD float clampUnit(float xi) { return xi > 0 ? std::min(xi, float{kBelowOne}) : 0.0f; }
inline GLINT_HD Vec2 clampUnit(Vec2 xi) { return {clampUnit(xi.x), clampUnit(xi.y)}; }

/// Chooses one of `count` things in proportion to weight(k) >= 0, which sum to `total`. Sets `xi` to its position inside the
/// share of the chosen thing: this is again uniform in [0, 1), so that one number serves several choices, and stratified
/// numbers stay stratified.
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

/// Chooses the thing of 16 at which the running sum of weights passes `reached`. Has no branch on the weights, which processors
/// could not predict.
/// @param sums  runningSums of the weights
/// @param xi    set to the position of `reached` inside the share of the chosen thing
/// @return index, or -1 if no weight is positive
inline GLINT_HD int chooseAt(const Float16& weights, const Float16& sums, float reached, float& xi) {
  float before[17], each[16];  // before[k]: sum of the first k weights
  before[0] = 0;
  sums.store(before + 1);
  weights.store(each);
  const int k = lowestBit(~std::uint64_t{sums.notAbove(reached)});
  // Sums are rounded: `reached` may pass the last sum, or fall on a thing without weight.
  if (k == 16 || !(each[k] > 0)) {
    xi = clampUnit(reached / before[16]);
    return chooseIndex(
        16, before[16], [&](int i) { return each[i]; }, xi);
  }
  xi = clampUnit((reached - before[k]) / each[k]);
  return k;
}
inline GLINT_HD int chooseAt(const Float16& weights, float reached, float& xi) {
  return chooseAt(weights, weights.runningSums(), reached, xi);
}

/// chooseIndex among 16 things.
inline GLINT_HD int chooseOf16(const Float16& weights, float& xi) {
  const Float16 sums = weights.runningSums();
  return chooseAt(weights, sums, xi * sums.v[3].lastLane(), xi);
}

/// chooseIndex among many things.
/// @tparam kMost   upper bound of weights.count()
/// @param weights  count(): number of things; group(g): Float16 of the weights of things 16 g to 16 g + 15, 0 beyond the end;
///                 sumGroups(sums): writes the sums of all groups
template <int kMost, class Weights>
GLINT_HD int chooseOfMany(const Weights& weights, float& xi) {
  float before[std::size_t{(kMost + 15) / 16 + 1}];  // before[g]: sum of the groups before group g
  before[0] = 0;
  const int groups = (weights.count() + 15) / 16;
  if (groups == 0) return -1;
  weights.sumGroups(before + 1);
  for (int g = 0; g < groups; ++g) before[g + 1] += before[g];
  const float reached = xi * before[groups];
  int group = 0;
  for (int g = 1; g < groups; ++g) group += before[g] <= reached ? 1 : 0;
  const int k = chooseAt(weights.group(group), reached - before[group], xi);
  return k < 0 ? -1 : 16 * group + k;
}

/// Number of the set bit of a mask that has `rank` set bits below it.
inline GLINT_HD int placeOfRank(const std::uint64_t* mask, int rank) {
  int word = 0;
  for (int bits = setBits(mask[0]); bits <= rank; bits = setBits(mask[++word])) rank -= bits;
  return 64 * word + selectBit(mask[word], rank);
}

}  // namespace glint
