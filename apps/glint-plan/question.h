#pragma once

#include <string>
#include <vector>

#include "glint-plan/scene.h"
#include "measure/workload.h"

namespace glint::apps {

/// What is asked of a map.
struct MapQuestion {
  FootprintRange footprints;
  float sigma_r = 0.005f;
  double light_deg = 0;  ///< of the sharpest light

  /// Sizes at which errors are measured: the ends, and so many between them that neighbours are at most `step` apart.
  /// @param most  sizes in all
  /// @param cap   larger footprints look like this one, texels
  std::vector<float> sizes(int most, double cap) const;
  /// A text that names everything that measurements depend on.
  std::string key() const;
};

/// Round footprints of these sizes at random places of a map.
std::vector<FootprintSet> questionSets(std::uint64_t seed, const std::vector<float>& sizes, int places, int truths);

}  // namespace glint::apps
