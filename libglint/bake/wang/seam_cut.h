#pragma once

#include <cstdint>
#include <span>
#include <vector>

#include "glint/math/vec.h"

namespace glint::bake {

/// Which of two overlapping images a texel takes.
enum class SeamSide : std::uint8_t {
  free,    ///< the cut decides; only in problems
  first,   ///< the first image
  second,  ///< the second image
  none,    ///< no texel of the overlap; only in problems
};

/// Two images that overlap in a rectangle, and the texels whose image is given.
struct SeamProblem {
  int width = 0;
  int height = 0;
  std::span<const Vec2> first;      ///< [height][width] normals
  std::span<const Vec2> second;     ///< [height][width] normals
  std::span<const SeamSide> sides;  ///< [height][width]
};

/// Cost of a seam between two neighbouring texels: how much the images differ at both (Kwatra et al. 2003, "M(s, t)"). Normals are
/// compared, not colours.
float seamDifference(Vec2 first_here, Vec2 second_here, Vec2 first_there, Vec2 second_there);

/// Divides an overlap between two images along the seam of least cost: the minimum cut of the graph of neighbouring texels, by
/// maximum flow (Boykov and Kolmogorov 2004).
///
/// The cost of a seam is the sum of seamDifference over the pairs of neighbours that it separates, and a little for each pair, so
/// that seams are short where the images agree. Costs are whole numbers, so the cut is the same on every machine.
/// @return [height][width]: first or second where the problem has a texel, none elsewhere
/// @note O(texels) memory: about 250 bytes for each free texel
std::vector<SeamSide> cutSeam(const SeamProblem& problem);

}  // namespace glint::bake
