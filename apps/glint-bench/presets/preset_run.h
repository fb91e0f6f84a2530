#pragma once

#include <nlohmann/json.hpp>
#include <optional>
#include <string>
#include <vector>

#include "common/tool.h"
#include "measure/asset_folder.h"

namespace glint::apps {

/// The form of the results of a preset; docs/json/files/preset-results.schema.json describes it.
inline constexpr const char* kPresetSchema = "glint-bench preset 1";

std::vector<std::string> presetNames();

/// Makes the figures of one paper, with progress.
/// @param name  one of presetNames
/// @return {schema, generator, machine, seed, quick, preset, paper, rows: [{source, subject, figure, unit, paper, ours, note}]}
nlohmann::ordered_json runPreset(Tool& tool, const AssetFolder& folder, const std::string& name, bool quick);

/// Reads such results.
/// @return nothing if a file is no JSON document of this form
/// @throws Error io if it cannot be read; invalid_input if it is of this form and lacks a part
std::optional<nlohmann::ordered_json> readPreset(const std::string& path);

/// A table of all rows: the paper's figure, ours, and ours over the paper's.
std::string presetText(const nlohmann::ordered_json& results);

}  // namespace glint::apps
