#pragma once

#include <nlohmann/json_fwd.hpp>

#include "glint/formats/asset_reader.h"

namespace glint::apps {

/// What the values of an asset amount to: shares, extremes, errors. What a kind has depends on the kind.
/// @note reads all values of normals and heights; O(clusters) for compressed pyramids
nlohmann::ordered_json statisticsOf(const formats::Asset& asset);

}  // namespace glint::apps
