#include "glint-pyramid/make_pyramid.h"

#include <fmt/format.h>

#include <nlohmann/json.hpp>

namespace glint::apps {

PyramidReport makePyramid(Tool& tool, const NormalMap& map, const bake::PyramidOptions& values, KeepNormals keep,
                          const std::string& output, const formats::Provenance& provenance,
                          const formats::WriteOptions& write) {
  tool.requireMemory(bake::pyramidBytes(map, values, static_cast<double>(tool.maxMemory())) + keptBytes(map, keep),
                     "the NDF images", kLessMemory);
  const auto kept = keptNormals(tool, map, keep);
  const bake::NdfPyramidData pyramid = bake::buildPyramid(map, values, tool.progress("images"));
  NdfPyramid asset = pyramid.view();
  if (kept) asset.near_normals = kept->view();
  formats::writeAsset(output, asset, provenance, write);
  PyramidReport report = {pyramidJson(pyramid), pyramidText(pyramid)};
  if (kept) {
    const std::uint64_t bytes = bake::nearBytes(kept->view());
    report.json["near_normals_bytes"] = bytes;
    report.text += fmt::format("and {:.2f} MB of normals for footprints below level 0\n", 1e-6 * static_cast<double>(bytes));
  }
  return report;
}

}  // namespace glint::apps
