#include "glint-plan/plan_map.h"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <filesystem>

#include "common/child_process.h"
#include "common/files.h"
#include "common/input_asset.h"
#include "glint/formats/hash.h"

namespace glint::apps {
namespace {

namespace fs = std::filesystem;

std::string fileOf(const SceneMaterial& material, const std::string& maps) { return (fs::path(maps) / material.map).string(); }

}  // namespace

void checkSceneFile(Tool& tool, const Scene& scene, const std::string& field, const std::string& file) {
  try {
    checkRegular(file);
  } catch (const Error& error) {
    throw Error(error.code(), error.rule(), scene.file, field, file + ": " + error.clause(),
                "check the name, and the folder that --maps names");
  }
  const std::vector<std::string> known = tool.readPaths();
  if (std::find(known.begin(), known.end(), file) == known.end()) tool.addInput(file);
}

void checkMaps(Tool& tool, const Scene& scene, const std::string& maps) {
  for (const SceneMaterial& material : scene.materials)
    checkSceneFile(tool, scene, material.path + ".map", fileOf(material, maps));
}

PlanMap openMap(Tool& tool, const AssetFolder& folder, const Scene& scene, const SceneMaterial& material,
                const std::string& maps) {
  PlanMap map;
  map.image = map.path = fileOf(material, maps);
  map.hash = formats::hashFile(map.image);
  if (!material.map.ends_with(".glint")) {
    std::string id = "map";
    for (const std::string& flag : material.ingest_flags) id += " " + flag;
    map.path = folder.fileOf(map.hash, id);
    std::vector<std::string> words = {"glint-ingest", map.image, "-o", map.path, "--force", "--quiet"};
    words.insert(words.end(), material.ingest_flags.begin(), material.ingest_flags.end());
    for (const std::string& flag : childFlags(tool)) words.push_back(flag);
    const ChildRun run = runProgram(words, {.shared_file = folder.lock()});
    if (run.exit_code != 0)
      throw Error(ErrorCode::invalid_input, "scene.map", scene.file, material.path + ".map", run.message,
                  "say in the scene how the image is read: kind, convention, height_scale");
    map.ingest_s = std::min(run.wall_s, run.cpu_s);
  }
  map.asset = openInput(tool, map.path);
  map.bytes = static_cast<double>(fs::file_size(map.path));
  if (map.asset->kind() != "normals") {
    throw Error(ErrorCode::unsupported, "scene.map", scene.file, material.path + ".map",
                map.image + " is of kind " + std::string(map.asset->kind()) + ", and plans are for maps of kind normals",
                "give an image, or the asset that glint-ingest makes of one");
  }
  return map;
}

std::string sizeText(double bytes) {
  if (bytes < 1e4) return fmt::format("{:.0f} bytes", bytes);
  if (bytes < 1e6) return fmt::format("{:.3g} kB", bytes / 1e3);
  return fmt::format("{:.3g} MB", bytes / 1e6);
}

std::string queryTimeText(double nanoseconds) {
  if (nanoseconds < 100) return fmt::format("{:.3g} ns", nanoseconds);
  const double unit = std::pow(10, std::floor(std::log10(nanoseconds)) - 2);
  return fmt::format("{:.0f} ns", unit * std::round(nanoseconds / unit));
}

}  // namespace glint::apps
