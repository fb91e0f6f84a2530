#pragma once

#include <functional>
#include <nlohmann/json.hpp>
#include <optional>
#include <string>

namespace glint::apps {

/// Reads a file of results of any form.
/// @return a discarded value if the file is no JSON document
/// @throws Error io if it cannot be read; invalid_input if it is nested deeper than kMostJsonDepth
nlohmann::ordered_json parseResultFile(const std::string& path);

/// Reads a file of results of a form.
/// @param schema   its member "schema" has this text
/// @param what     "tests of stability", for errors
/// @param command  that makes such results, for errors
/// @param read     reads every member that is needed; throws nlohmann::json::exception if one is not there
/// @return nothing if the file is no JSON document of this form
/// @throws Error io if it cannot be read; invalid_input if it is of this form and lacks a part, or is nested too deep
std::optional<nlohmann::ordered_json> readResultFile(const std::string& path, const std::string& schema,
                                                     const std::string& what, const std::string& command,
                                                     const std::function<void(const nlohmann::ordered_json&)>& read);

}  // namespace glint::apps
