#pragma once

#include <optional>
#include <string>
#include <vector>

#include "glint-plan/json_field.h"
#include "measure/camera_footprints.h"

namespace glint::apps {

/// What a plan makes as small as it can.
enum class Goal : std::uint8_t { bytes, query_ns, preparation_s };
const char* goalName(Goal goal);

/// Most that may be spent; nothing: without limit.
struct Budgets {
  std::optional<double> bytes;
  std::optional<double> preparation_s;
  std::optional<double> query_ns;  ///< of one density on one thread
};

/// A light, by the smallest angle over which it changes what a facet shows.
struct SceneLight {
  std::string type;       ///< "point", "directional" or "environment"
  std::string image;      ///< of an environment, in the folder of maps: its band limit is measured; may be empty
  double smooth_deg = 0;  ///< angular diameter, or band limit of an environment, degrees; 0: sharp
};

/// The scale of a map on its surface.
struct MapScale {
  double texel_size_um = 0;  ///< 0: not given
  double uv_size = 0;        ///< scene units that u from 0 to 1 covers; 0: not given
};

/// A material: its map, and the questions about it.
struct SceneMaterial {
  std::string name;
  std::string map;                        ///< file, in the folder of maps
  std::vector<std::string> ingest_flags;  ///< of glint-ingest
  MapScale scale;
  std::optional<FootprintRange> footprints;  ///< nothing: from the camera
  double sigma_r = 0.005;
  double tolerance = 0;
  Budgets budgets;   ///< of this material alone
  std::string path;  ///< "materials[0]", for errors
};

/// What a scene will ask.
struct Scene {
  std::string file;
  Goal goal = Goal::bytes;
  Budgets budgets;  ///< of all materials together; query_ns of each
  double unit_m = 1;
  std::optional<CameraView> camera;
  std::vector<SceneLight> lights;
  std::vector<SceneMaterial> materials;

  /// The light with the sharpest edge, which needs most detail.
  const SceneLight& sharpest() const;
};

/// Reads docs/json/files/scene.schema.json.
/// @throws Error io; invalid_input, which names the field
Scene readScene(const std::string& path);
Scene sceneOf(const JsonField& document, const std::string& path);

/// Footprints that a scene asks of a material.
/// @param width  of the map, texels
/// @throws Error invalid_input if a texel is so large that it must be a mistake of units
FootprintRange footprintsOf(const Scene& scene, const SceneMaterial& material, int width);

}  // namespace glint::apps
