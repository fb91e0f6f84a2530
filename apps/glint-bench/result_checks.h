#pragma once

#include <nlohmann/json.hpp>
#include <string>

namespace glint::apps {

/// What is wrong with a bench's results, of which the table and the page read every part; empty if nothing is. Pictures, images and
/// errors of measurements must be of the sizes of their map.
std::string faultOf(const nlohmann::ordered_json& document);

}  // namespace glint::apps
