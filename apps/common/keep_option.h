#pragma once

#include <optional>

#include "common/tool.h"
#include "glint/bake/ingest/near_normals.h"

namespace glint::apps {

/// What --keep-normals asks for.
enum class KeepNormals : unsigned char { as_input, none, f32, i16 };

/// Memory that keptNormals takes at its peak, bytes.
double keptBytes(const NearNormals& normals, KeepNormals keep);

/// Normals in the form that was asked for; nothing for `none`.
/// @param normals  those of the map, or of an asset that keeps them
/// @throws Error   failed: keeping them takes more than --max-memory
std::optional<bake::NearNormalsData> keptNormals(const Tool& tool, const NearNormals& normals, KeepNormals keep);

}  // namespace glint::apps
