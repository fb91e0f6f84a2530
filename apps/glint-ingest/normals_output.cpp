#include "glint-ingest/normals_output.h"

#include "glint/bake/ingest/normal_bounds.h"

namespace glint::apps {

void writeNormals(const NormalsOutput& output, int width, int height, float texel_size_um, std::span<const Vec2> normals,
                  const MapSlopes& slopes) {
  NormalMap map;
  map.width = width, map.height = height;
  map.texel_size_um = texel_size_um;
  map.normals = normals, map.slopes = slopes;
  const auto bounds = bake::buildNormalBounds(map.width, map.height, map.normals);
  bake::attachBounds(map, bounds);
  formats::writeAsset(output.path, map, output.provenance, output.options);
}

}  // namespace glint::apps
