#include "common/keep_option.h"

#include "common/files.h"

namespace glint::apps {

namespace {

NearType typeOf(const NearNormals& normals, KeepNormals keep) {
  return keep == KeepNormals::as_input ? normals.type : keep == KeepNormals::i16 ? NearType::i16 : NearType::f32;
}

}  // namespace

double keptBytes(const NearNormals& normals, KeepNormals keep) {
  return keep == KeepNormals::none ? 0 : bake::keepNormalsBytes(normals.width, normals.height, typeOf(normals, keep));
}

std::optional<bake::NearNormalsData> keptNormals(const Tool& tool, const NearNormals& normals, KeepNormals keep) {
  if (keep == KeepNormals::none) return {};
  tool.requireMemory(keptBytes(normals, keep), "keeping the normals", "give --keep-normals none");
  return bake::keepNormals(normals, typeOf(normals, keep));
}

}  // namespace glint::apps
