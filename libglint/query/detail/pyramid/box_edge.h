#pragma once

#include <algorithm>
#include <cmath>

#include "glint/math/device.h"
#include "glint/model/ndf_pyramid.h"
#include "glint/query/interpolation.h"

namespace glint {

/// An edge of a box of half vectors on one axis of a block of pixels. The sum of the density up to the edge is a weighted sum of
/// four sums of whole pixels: those below `pixels[k]`, 0 to 16, with `parts[k]`. Parts sum to 1.
///
/// With Pixels::constant a pixel counts by its covered part. With Pixels::smooth the density is a parabola in each pixel, whose
/// value at a border is the mean of the two pixels there: PixelSpline without its bounds. So the sum is a cubic function, and
/// depends on the neighbours of the pixel that the edge cuts. Both are exact where the edge is on a border of pixels.
struct BoxEdge {
  static constexpr int kTaps = 4;

  BoxEdge() = default;
  /// @param x  position in pixels of the block
  GLINT_HD BoxEdge(float x, Pixels kind) {
    // An edge beyond the neighbouring pixel is as far as all pixels of the block or none.
    x = std::clamp(x, -1.0f, static_cast<float>(kBlockSize + 1));
    const float cut = std::floor(x), t = x - cut;
    for (int k = 0; k < kTaps; ++k) pixels[k] = std::clamp(static_cast<int>(cut) - 1 + k, 0, int{kBlockSize});
    if (kind == Pixels::constant)
      setParts(1, t, 0);
    else
      setParts(1 + 0.5f * t * (1 - t) * (1 - t), t * (0.5f + t * (1.5f - t)), 0.5f * t * t * (t - 1));
  }

  /// Shares that lie below the edge: of the pixel before the one that it cuts, of this one, and of the next one.
  GLINT_HD void setParts(float before, float here, float after) {
    parts[0] = 1 - before;
    parts[1] = before - here;
    parts[2] = here - after;
    parts[3] = after;
  }

  /// The first pixel that the edge does not have wholly below it.
  GLINT_HD int firstAbove() const { return parts[0] == 0 ? pixels[1] : pixels[0]; }
  /// One after the last pixel of which a part counts as below the edge.
  GLINT_HD int endBelow() const { return parts[3] != 0 ? pixels[3] : parts[2] != 0 ? pixels[2] : pixels[1]; }
  /// Whether the edge cuts no pixel and no neighbour of one.
  GLINT_HD bool isWhole() const { return parts[1] == 1; }

  int pixels[kTaps];
  float parts[kTaps];
};

/// The part of a box of half vectors that concerns a block: edges on both axes.
struct BlockBox {
  BoxEdge x0, x1, y0, y1;
};

/// Sum between two edges of sums of whole pixels.
/// @param below  below(k): sum of the pixels below pixel k, for k = 0 to 16
template <class Below>
GLINT_HD float sumBetween(const BoxEdge& low, const BoxEdge& high, Below&& below) {
  float sum = 0;
  for (int k = 0; k < BoxEdge::kTaps; ++k) {
    if (high.parts[k] != 0) sum += high.parts[k] * below(high.pixels[k]);
    if (low.parts[k] != 0) sum -= low.parts[k] * below(low.pixels[k]);
  }
  return sum;
}

}  // namespace glint
