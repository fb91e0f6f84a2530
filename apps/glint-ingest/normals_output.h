#pragma once

#include <span>
#include <string>

#include "glint/formats/asset_writer.h"
#include "glint/model/map_slopes.h"

namespace glint::apps {

/// Where normals are written.
struct NormalsOutput {
  std::string path;
  formats::Provenance provenance;
  formats::WriteOptions options;
};

/// Adds the min-max pyramid to normals and writes the asset.
void writeNormals(const NormalsOutput& output, int width, int height, float texel_size_um, std::span<const Vec2> normals,
                  const MapSlopes& slopes);

}  // namespace glint::apps
