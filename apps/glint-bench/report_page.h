#pragma once

#include <cstdint>
#include <nlohmann/json.hpp>
#include <string>

namespace glint::apps {

/// The forms of results that can be shown.
enum class ResultForm : std::uint8_t {
  measurements,  ///< of methods on maps
  stability,     ///< tests of stability
  preset,        ///< figures of a paper
};

/// Writes a page that shows results: one file of HTML with its charts' library inside, which asks no network.
/// @throws Error io
void writeReportPage(const nlohmann::ordered_json& document, ResultForm form, const std::string& path);

}  // namespace glint::apps
