#include "glint-plan/scene.h"

#include <fmt/format.h>

#include <algorithm>
#include <set>

#include "glint/model/error.h"

namespace glint::apps {
namespace {

constexpr const char* kSceneForm = "glint-plan scene 1";
/// Deviations of footprints that a scene may ask for, texels: from the middle of a texel to larger than any map.
constexpr double kSmallestTexels = 0.05, kLargestTexels = 1e6;
/// Texels of more than a centimetre are no microstructure.
constexpr double kLargestTexel_um = 1e4;

Budgets budgetsOf(const std::optional<JsonField>& field) {
  Budgets budgets;
  if (!field) return budgets;
  field->allow({"bytes", "preparation_s", "query_ns"});
  if (const auto bytes = field->find("bytes")) budgets.bytes = bytes->positive();
  if (const auto seconds = field->find("preparation_s")) budgets.preparation_s = seconds->positive();
  if (const auto time = field->find("query_ns")) budgets.query_ns = time->positive();
  return budgets;
}

CameraView cameraOf(const JsonField& field) {
  field.allow({"nearest", "farthest", "field_of_view_deg", "columns", "samples_per_pixel"});
  CameraView camera;
  camera.nearest = field.member("nearest", "give the smallest distance to a surface, in scene units").positive();
  const JsonField farthest = field.member("farthest", "give the largest distance to a surface, in scene units");
  camera.farthest = farthest.positive();
  if (camera.farthest < camera.nearest) farthest.refuse("is less than nearest", "swap the two");
  camera.field_of_view_deg =
      field.member("field_of_view_deg", "give the angle that the columns of the picture cover").number(0.01, 175);
  camera.columns = field.member("columns", "give the pixels of a row of the picture").integer(1, 1 << 20);
  if (const auto samples = field.find("samples_per_pixel")) camera.samples = samples->integer(1, 1 << 20);
  return camera;
}

SceneLight lightOf(const JsonField& field) {
  SceneLight light;
  light.type = field.member("type", "give point, directional or environment").word({"point", "directional", "environment"});
  if (light.type == "environment") {
    field.allow({"type", "band_limit_deg", "image"});
    const auto image = field.find("image"), limit = field.find("band_limit_deg");
    if (image && limit) limit->refuse("is measured from the image", "leave one of them out");
    if (image) {
      light.image = image->text();
    } else {
      light.smooth_deg =
          field
              .member("band_limit_deg", "give the smallest angle over which the light changes, or the image of the environment")
              .number(0.01, 180);
    }
    return light;
  }
  field.allow({"type", "angular_diameter_deg"});
  if (const auto diameter = field.find("angular_diameter_deg")) light.smooth_deg = diameter->number(0, 180);
  return light;
}

std::vector<std::string> ingestFlags(const JsonField& field) {
  const auto kind = field.find("kind"), convention = field.find("convention"), scale = field.find("height_scale");
  std::vector<std::string> flags;
  const bool heights = kind && kind->word({"normals", "heights"}) == "heights";
  if (heights) flags = {"--kind", "height"};
  if (convention) {
    if (heights) convention->refuse("heights have no convention", "leave it out");
    flags.insert(flags.end(), {"--convention", convention->word({"opengl", "directx"})});
  }
  if (scale) {
    if (!heights) scale->refuse("is for maps of heights", "leave it out, or say \"kind\": \"heights\"");
    flags.insert(flags.end(), {"--height-scale", fmt::format("{:.9g}", scale->positive())});
  }
  return flags;
}

void readMap(const JsonField& map, SceneMaterial& material) {
  if (map.isText()) {
    material.map = map.text();
  } else {
    map.allow({"file", "kind", "convention", "height_scale"});
    material.map = map.member("file", "give the name of an image or of an asset of kind normals").text();
    material.ingest_flags = ingestFlags(map);
  }
  if (material.map.ends_with(".glint") && !material.ingest_flags.empty())
    map.refuse("an asset says itself what it holds", "give the name of the file alone");
}

MapScale scaleOf(const JsonField& field) {
  const auto texel = field.find("texel_size_um"), size = field.find("uv_size");
  if (texel && size) size->refuse("texel_size_um says the same", "leave one of them out");
  MapScale scale;
  if (texel)
    scale.texel_size_um =
        texel->number(1e-6, kLargestTexel_um, "micrometres; larger texels are no microstructure, or in other units");
  if (size) scale.uv_size = size->positive();
  return scale;
}

FootprintRange rangeOf(const JsonField& field) {
  field.allow({"smallest_texels", "largest_texels"});
  FootprintRange range;
  range.smallest =
      field.member("smallest_texels", "give the deviation of the smallest footprint").number(kSmallestTexels, kLargestTexels);
  const JsonField largest = field.member("largest_texels", "give the deviation of the largest footprint");
  range.largest = largest.number(kSmallestTexels, kLargestTexels);
  if (range.largest < range.smallest) largest.refuse("is less than smallest_texels", "swap the two");
  return range;
}

SceneMaterial materialOf(const JsonField& field, const Scene& scene, const std::string& path) {
  field.allow({"name", "map", "texel_size_um", "uv_size", "footprints", "sigma_r", "tolerance", "budgets"});
  SceneMaterial material;
  material.path = path;
  readMap(field.member("map", "give the name of an image or of an asset of kind normals"), material);
  material.name = material.map.substr(0, material.map.rfind('.'));
  if (const auto name = field.find("name")) material.name = name->text();
  material.scale = scaleOf(field);
  const bool scaled = material.scale.texel_size_um > 0 || material.scale.uv_size > 0;
  if (const auto range = field.find("footprints")) {
    material.footprints = rangeOf(*range);
  } else if (!scene.camera) {
    field.member("footprints", "give smallest_texels and largest_texels, or the scene a camera");
  } else if (!scaled) {
    field.member("texel_size_um", "give the size of a texel, or uv_size, so that the camera's pixels can be told in texels");
  }
  if (const auto sigma = field.find("sigma_r")) material.sigma_r = sigma->number(0.0001, 0.25);
  constexpr double kSmallestTolerance = 1e-3;  // below the noise of a probe
  material.tolerance = field.member("tolerance", "give the largest seen error, such as 0.1")
                           .number(kSmallestTolerance, 10, "the largest seen error; only the texels themselves have none");
  material.budgets = budgetsOf(field.find("budgets"));
  return material;
}

}  // namespace

const char* goalName(Goal goal) {
  switch (goal) {
    case Goal::bytes:
      return "bytes";
    case Goal::query_ns:
      return "query_ns";
    case Goal::preparation_s:
      return "preparation_s";
  }
  return "bytes";
}

const SceneLight& Scene::sharpest() const {
  return *std::min_element(lights.begin(), lights.end(),
                           [](const SceneLight& a, const SceneLight& b) { return a.smooth_deg < b.smooth_deg; });
}

Scene readScene(const std::string& path) { return sceneOf(JsonField::read(path), path); }

Scene sceneOf(const JsonField& document, const std::string& path) {
  document.allow({"schema", "minimise", "budgets", "unit_m", "camera", "lights", "materials"});
  document.member("schema", std::string("give \"") + kSceneForm + "\"").word({kSceneForm});
  Scene scene;
  scene.file = path;
  if (const auto goal = document.find("minimise")) {
    const std::string name = goal->word({"bytes", "query_ns", "preparation_s"});
    for (const Goal each : {Goal::bytes, Goal::query_ns, Goal::preparation_s})
      if (name == goalName(each)) scene.goal = each;
  }
  scene.budgets = budgetsOf(document.find("budgets"));
  if (const auto unit = document.find("unit_m")) scene.unit_m = unit->positive();
  if (const auto camera = document.find("camera")) scene.camera = cameraOf(*camera);
  for (const JsonField& light : document.member("lights", "give a list of lights, such as [{\"type\": \"point\"}]").elements())
    scene.lights.push_back(lightOf(light));
  std::set<std::string> names;
  const auto materials = document.member("materials", "give a list of materials").elements();
  for (std::size_t k = 0; k < materials.size(); ++k) {
    scene.materials.push_back(materialOf(materials[k], scene, fmt::format("materials[{}]", k)));
    if (!names.insert(scene.materials.back().name).second)
      materials[k].refuse("another material has the name " + scene.materials.back().name, "give it a name of its own");
  }
  return scene;
}

FootprintRange footprintsOf(const Scene& scene, const SceneMaterial& material, int width) {
  if (material.footprints) return *material.footprints;
  const double um_per_unit = 1e6 * scene.unit_m;
  double texel_um = material.scale.texel_size_um;
  const bool by_size = !(texel_um > 0);
  if (by_size) texel_um = material.scale.uv_size * um_per_unit / width;
  if (by_size && texel_um > kLargestTexel_um) {
    throw Error(ErrorCode::invalid_input, "scene.field", scene.file, material.path + ".uv_size",
                fmt::format("makes a texel {:.3g} m wide, which is no microstructure", 1e-6 * texel_um),
                "give the scene units that the map covers, and unit_m, the metres of a scene unit");
  }
  FootprintRange range = footprintsOfCamera(*scene.camera, um_per_unit / texel_um);
  if (range.largest > kLargestTexels) {
    throw Error(ErrorCode::invalid_input, "scene.field", scene.file, material.path + (by_size ? ".uv_size" : ".texel_size_um"),
                fmt::format("makes the farthest pixel {:.3g} texels wide", range.largest),
                "check it, unit_m and the camera's distances");
  }
  range.smallest = std::max(range.smallest, kSmallestTexels);
  range.largest = std::max(range.largest, range.smallest);
  return range;
}

}  // namespace glint::apps
