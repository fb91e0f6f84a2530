#pragma once

#include <nlohmann/json.hpp>
#include <string>

#include "glint-pyramid/pyramid_options.h"
#include "glint/formats/asset_writer.h"

namespace glint::apps {

/// The report of a pyramid that was made: for --json, and for people.
struct PyramidReport {
  nlohmann::json json;
  std::string text;
};

/// Builds the pyramid of a map, and writes it with the normals that it keeps.
/// @throws Error failed: too much memory; io
PyramidReport makePyramid(Tool& tool, const NormalMap& map, const bake::PyramidOptions& values, KeepNormals keep,
                          const std::string& output, const formats::Provenance& provenance, const formats::WriteOptions& write);

}  // namespace glint::apps
