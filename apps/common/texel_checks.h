#pragma once

#include <cstdint>
#include <span>
#include <string>

#include "glint/formats/asset_reader.h"
#include "glint/model/normal_map.h"

namespace glint::apps {

/// Refuses texels that are no normals: builders follow their numbers into arrays.
/// @param rows  [height]: 1 where a row is to be checked; empty: all
/// @param path  of the asset, for the message
/// @throws Error invalid_input, naming the first such texel
/// @note one pass over the normals, which is little beside any work with them
void requireNormals(const NormalMap& map, const std::string& path, std::span<const std::uint8_t> rows = {});

/// Refuses texels that builders cannot work with, of kinds normals, wang-tiles and heights, and kept in shards: also what --trust leaves.
/// @throws Error invalid_input
void requireTexels(const formats::Asset& asset, const std::string& path);

}  // namespace glint::apps
