#include "common/keep_option.h"

#include "common/files.h"

namespace glint::apps {

std::optional<bake::NearNormalsData> keptNormals(const Tool& tool, const NearNormals& normals, KeepNormals keep) {
  if (keep == KeepNormals::none) return {};
  const NearType type = keep == KeepNormals::as_input ? normals.type : keep == KeepNormals::i16 ? NearType::i16 : NearType::f32;
  tool.requireMemory(bake::keepNormalsBytes(normals.width, normals.height, type), "keeping the normals",
                     "give --keep-normals none");
  return bake::keepNormals(normals, type);
}

}  // namespace glint::apps
