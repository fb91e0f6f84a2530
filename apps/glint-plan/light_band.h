#pragma once

#include <string>

#include "common/tool.h"
#include "glint-plan/scene.h"
#include "measure/asset_folder.h"

namespace glint::apps {

/// Measures the band limits of the environments that a scene names as images, and sets their `smooth_deg`.
/// @param maps  folder in which the images are
/// @throws Error io or invalid_input, with the field of the scene, if an image cannot be read
void measureEnvironments(Tool& tool, const AssetFolder& folder, Scene& scene, const std::string& maps);

/// Order of the spherical harmonics that a light needs on facets of this roughness: the smaller of the band limits of both.
/// @param light_deg  smallest angle over which the light changes, degrees; 0: sharp, and the facets alone decide
int shOrder(double light_deg, double sigma_r);

}  // namespace glint::apps
