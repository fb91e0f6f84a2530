#pragma once

#include <nlohmann/json.hpp>
#include <optional>
#include <string>
#include <vector>

#include "common/tool.h"
#include "measure/asset_folder.h"

namespace glint::apps {

/// The form of the results of the tests of stability; docs/json/files/stability-results.schema.json describes it.
inline constexpr const char* kStabilitySchema = "glint-bench stability 1";

/// Names of all tests.
std::vector<std::string> stabilityNames();

/// Runs the tests, with progress.
/// @param only  names of tests; empty: all
/// @return {schema, generator, seed, quick, tests: [{name, title, question, axis, figure, tolerable, instead, points: [{series, x,
///         value or message}]}]}
nlohmann::ordered_json runStability(Tool& tool, const AssetFolder& folder, const std::vector<std::string>& only, bool quick);

/// Reads such results.
/// @return nothing if a file is no JSON document of this form
/// @throws Error io if it cannot be read; invalid_input if it is of this form and lacks a part
std::optional<nlohmann::ordered_json> readStability(const std::string& path);

/// For each test, the figures of every method. Those that are more than tolerable have an exclamation mark.
std::string stabilityText(const nlohmann::ordered_json& results);

}  // namespace glint::apps
