#pragma once

#include <string>
#include <string_view>
#include <vector>

namespace glint::apps {

/// The candidate that a misspelt word was probably meant to be: the one with the smallest edit distance, if that is at most a
/// third of the word (and at least 1). Empty when none is near.
std::string nearestName(std::string_view word, const std::vector<std::string>& candidates);

}  // namespace glint::apps
