#pragma once

#include <nlohmann/json_fwd.hpp>
#include <string>

#include "glint/formats/asset_reader.h"

namespace glint::apps {

/// Version of the JSON that summarize makes: grows when a key changes its meaning or goes away.
inline constexpr int kSummarySchemaVersion = 3;

/// What an asset is: {"schema_version", "kind", "format_version", "file_bytes", "provenance", "properties", "statistics",
/// "datasets"}. Properties are the attributes of SPEC.md.
/// @note reads all values of normals and heights; O(clusters) for compressed pyramids
nlohmann::ordered_json summarize(const formats::Asset& asset);

/// The same for people: aligned columns.
std::string summaryText(const std::string& path, const nlohmann::ordered_json& summary);

}  // namespace glint::apps
