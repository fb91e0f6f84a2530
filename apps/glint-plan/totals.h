#pragma once

#include <optional>
#include <vector>

namespace glint::apps {

/// What an option of a material adds to the totals of a scene.
struct Share {
  double goal = 0;  ///< what is made small
  double bytes = 0;
  double preparation_s = 0;
};

/// One option of each material, so that the sum of `goal` is as small as it can be within limits of the sums of bytes and seconds.
/// @param options  [material][option]
/// @return numbers of the options; nothing if no choice is within the limits
std::optional<std::vector<std::size_t>> cheapestWithin(const std::vector<std::vector<Share>>& options, double most_bytes,
                                                       double most_preparation_s);

}  // namespace glint::apps
