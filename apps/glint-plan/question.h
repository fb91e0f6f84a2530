#pragma once

#include <string>
#include <vector>

#include "glint-plan/scene.h"
#include "glint/model/normal_map.h"
#include "measure/place_errors.h"

namespace glint::apps {

/// What is asked of a map.
struct MapQuestion {
  FootprintRange footprints;
  float sigma_r = 0.005f;
  double light_deg = 0;  ///< of the sharpest light

  /// Sizes at which errors are measured: the ends, and so many between them that each is at most twice the one before, if `most` allows.
  /// @param most  sizes in all
  /// @param cap   larger footprints look like this one, texels
  std::vector<float> sizes(int most, double cap) const;
  /// A text that names everything that measurements depend on.
  std::string key() const;
};

/// Sizes at which errors are measured, at most.
inline constexpr int kQuestionSizes = 5;
/// Places at which the error of a plan is measured.
inline constexpr int kQuestionPlaces = 96;
/// Questions with which the time of a density is measured, of a probe as of a whole map.
inline constexpr int kTimedQueries = 4096;

/// The truth about round footprints of one size at random places of a map.
/// @param number  of the size: each has other places
PlaceTruth questionTruth(const NormalMap& map, const MapQuestion& question, std::uint64_t seed, std::size_t number,
                         float sigma_texels);

}  // namespace glint::apps
