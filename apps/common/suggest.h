#pragma once

#include <string>
#include <string_view>
#include <vector>

namespace glint::apps {

/// The candidate with the smallest edit distance from a misspelt word. Empty if the distance is above a third of the word's
/// length, and above 1.
std::string nearestName(std::string_view word, const std::vector<std::string>& candidates);

}  // namespace glint::apps
