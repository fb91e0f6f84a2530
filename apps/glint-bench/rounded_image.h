#pragma once

#include <nlohmann/json.hpp>
#include <vector>

namespace glint::apps {

/// An NDF image for a page: 64 x 64 densities of three digits, bottom row first.
/// @param image  [128][128]
nlohmann::ordered_json roundedImage(const std::vector<float>& image);

}  // namespace glint::apps
