#pragma once

#include <cstdint>

#include "glint/query/detail/tiny/normal_lobe.h"
#include "glint/query/detail/tiny/normal_turn.h"

namespace glint {

/// All that answers one footprint: images of tiles, lobes of elements, the surface between examples, and the mean of the plane.
/// Weights sum to 1.
struct TinyPieces {
  /// Sets no array: what is behind a count is not read.
  GLINT_HD TinyPieces() {}

  static constexpr int kMost = 128;
  static constexpr int kMostExamples = 96;

  /// Images of tiles, in a list for each example: images[k] of level levels[k]; the next one of the same example is next[k], or -1.
  float weights[kMost];
  std::int32_t images[kMost];
  std::int8_t levels[kMost];
  std::int16_t next[kMost];
  int image_count = 0;

  /// Examples that are seen: the first image of each, and how its normals turn.
  std::int16_t first[kMostExamples];
  union {
    NormalTurn turns[kMostExamples];
  };
  int example_count = 0;

  float lobe_weights[kMost];
  union {
    NormalLobe lobes[kMost];
  };
  int lobe_count = 0;

  float background = 0;  ///< share of the surface between examples
  float mean = 0;        ///< share of the mean of the plane

  GLINT_HD void addImage(int example, int level, int image, float weight) {
    if (image_count == kMost) return;
    weights[image_count] = weight;
    images[image_count] = image;
    levels[image_count] = static_cast<std::int8_t>(level);
    next[image_count] = first[example];
    first[example] = static_cast<std::int16_t>(image_count++);
  }
  GLINT_HD void addLobe(const NormalLobe& lobe, float weight) {
    if (lobe_count == kMost) return;
    lobe_weights[lobe_count] = weight;
    lobes[lobe_count++] = lobe;
  }
  GLINT_HD int addExample(const NormalTurn& turn) {
    first[example_count] = -1;
    turns[example_count] = turn;
    return example_count++;
  }

  /// Makes the weights of images and lobes sum to `share`.
  GLINT_HD void normalise(float share) {
    float total = 0;
    for (int k = 0; k < image_count; ++k) total += weights[k];
    for (int k = 0; k < lobe_count; ++k) total += lobe_weights[k];
    const float scale = total > 0 ? share / total : 0;
    for (int k = 0; k < image_count; ++k) weights[k] *= scale;
    for (int k = 0; k < lobe_count; ++k) lobe_weights[k] *= scale;
  }
};

}  // namespace glint
