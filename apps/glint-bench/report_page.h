#pragma once

#include <nlohmann/json.hpp>
#include <string>

namespace glint::apps {

/// Writes a page that shows the results of a bench: one file of HTML with its charts' library inside, which asks no network.
/// @throws Error io
void writeReportPage(const nlohmann::ordered_json& document, const std::string& path);

}  // namespace glint::apps
