#pragma once

#include <span>
#include <vector>

#include "glint/model/footprint.h"
#include "glint/model/normal_map.h"

namespace glint::apps {

/// Light that a map reflects towards cells of half vectors, over many places.
struct PlaceLight {
  std::vector<double> squares;     ///< [cells] sums over places of the mean square density of a cell
  std::vector<unsigned char> lit;  ///< [cells] whether light is seen there at any place
};

/// Computes the light of some places, quickly: as from exact images, but lobes end at 4 deviations. Cells are those of seen errors.
/// @param light_deg   angular diameter of the light, as in blurByLight
/// @param resolution  pixels of an image along each axis
/// @note parallel; the result does not depend on the number of threads. O(texels of the footprints x pixels of a lobe)
PlaceLight placeLight(const NormalMap& map, std::span<const Footprint> footprints, float sigma_r, double light_deg,
                      int resolution);

/// The least mean square density of round footprints over all places of a map, for each cell: the square of the mean of the map, and
/// the variance over places if neighbouring texels had nothing to do with each other. It counts every texel, so that a half vector
/// which one texel of a million shows has its light. Texels that are like their neighbours have more.
/// @return [cells]
std::vector<double> leastLight(const NormalMap& map, float sigma_texels, float sigma_r, double light_deg, int resolution);

/// Number of round footprints whose light tells what a map reflects to half vectors that few places show: the more, the smaller
/// footprints and lobes are, within a fixed amount of work.
/// @param least  places at least
std::size_t lightPlaces(float sigma_texels, float sigma_r, double light_deg, int resolution, std::size_t least);

}  // namespace glint::apps
