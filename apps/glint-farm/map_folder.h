#pragma once

#include <string>
#include <vector>

#include "glint-farm/manifest_builder.h"
#include "glint-farm/recipe.h"

namespace glint::apps {

/// The images in a folder and the folders in it, sorted, as the folder itself sees them. Hidden files and folders are left out.
/// @param assets  a folder in it that is left out
/// @throws Error io if there are none; usage if two have one name but for its ending
std::vector<std::string> imagesIn(const std::string& folder, const std::string& assets);

/// Jobs of one image: all steps of a recipe.
/// @param image   as its folder sees it: names the assets
/// @param maps    folder of the image, as the manifest's folder sees it
/// @param assets  folder of the assets, likewise
/// @param here    folder in which flags name files, likewise
/// @param map_shards  parts in which a pyramid is made, which a job of its own joins; 1: one run
std::vector<FarmJob> jobsOf(const std::string& image, const std::string& maps, const std::string& assets,
                            const std::string& here, const std::vector<RecipeStep>& recipe, int map_shards);

}  // namespace glint::apps
