#pragma once

#include <nlohmann/json.hpp>
#include <string>

namespace glint::apps {

/// Reads a file that people write: one JSON document, with no member of an object twice.
/// @param rule  of the errors, such as "scene.json"
/// @throws Error invalid_input, which names the place; io
nlohmann::json readJsonFile(const std::string& path, const char* rule);

/// Reads a file that a program wrote.
/// @return a discarded value if the file is no JSON, or is nested deeper than kMostJsonDepth
/// @throws Error io
nlohmann::json readJsonOrNothing(const std::string& path);

}  // namespace glint::apps
