#pragma once

#include <optional>
#include <string>
#include <vector>

#include "common/tool.h"
#include "glint-plan/scene.h"
#include "glint/formats/asset_reader.h"
#include "measure/asset_folder.h"

namespace glint::apps {

/// The map of a material, as an asset of kind normals.
struct PlanMap {
  std::string image;    ///< file that the scene names
  std::string hash;     ///< of this file
  std::string path;     ///< the asset
  double ingest_s = 0;  ///< 0: the file is the asset
  double bytes = 0;     ///< of the asset
  std::optional<formats::Asset> asset;
  const NormalMap& normals() const { return asset->get<NormalMap>(); }
};

/// Opens the map of a material, which is made of an image by glint-ingest.
/// @param maps  folder in which the scene's files are
/// @throws Error io, invalid_input, unsupported: with the field of the scene
PlanMap openMap(Tool& tool, const AssetFolder& folder, const Scene& scene, const SceneMaterial& material,
                const std::string& maps);

/// Adds a file that a scene names to the inputs of the run.
/// @param field  of the scene, which names the file
/// @throws Error io, with the field, unless the file can be read
void checkSceneFile(Tool& tool, const Scene& scene, const std::string& field, const std::string& file);

/// The same for the maps of all materials.
void checkMaps(Tool& tool, const Scene& scene, const std::string& maps);

/// The number of bytes in words: "1.2 MB".
std::string sizeText(double bytes);

/// The time of a query in words, to three digits: "3.21 ns", "126000 ns", as budgets have it.
std::string queryTimeText(double nanoseconds);

}  // namespace glint::apps
