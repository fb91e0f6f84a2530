#pragma once

#include <vector>

namespace glint::apps {

/// Diameter of the disk of half vectors towards which a round light shows a facet, disk units, near the normal: a half vector turns
/// by half of what the light's direction turns.
/// @param light_deg  angular diameter of the light, degrees
double halfVectorsOfLight(double light_deg);

/// Side of the square that stands for a light in blurByLight, pixels; 0: the light changes nothing.
double lightWidth(double light_deg, int resolution);

/// Blurs an NDF image as a round light does, which shows every half vector of a disk at once. A square of the same second moments
/// stands for the disk. Lights whose square is less than a pixel wide change nothing: the image has pixel means.
/// @param image      [resolution][resolution] densities over [-1, 1]^2; 0 beyond
/// @param light_deg  angular diameter of the light, degrees
void blurByLight(std::vector<float>& image, int resolution, double light_deg);

}  // namespace glint::apps
