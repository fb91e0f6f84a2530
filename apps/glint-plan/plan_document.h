#pragma once

#include <nlohmann/json.hpp>
#include <string>
#include <vector>

#include "glint-plan/planner.h"

namespace glint::apps {

/// The plan file: docs/json/files/plan.schema.json.
/// @param maps  folder of the maps, relative to the plan file
nlohmann::ordered_json planDocument(const Tool& tool, const Scene& scene, const nlohmann::json& scene_document,
                                    const std::string& maps, const std::vector<MaterialPlan>& plans);

/// A material as a plan file has it.
struct PlannedMaterial {
  std::size_t index = 0;  ///< in the scene
  std::string map_hash;
  Candidate candidate;
  Costs costs;
  PlaceErrors errors;
};

/// A plan file that was read.
struct PlanFile {
  std::string path;
  Scene scene;
  std::string maps;  ///< folder of the maps, from here
  std::vector<PlannedMaterial> materials;
};

/// @throws Error io; invalid_input if it is no plan of this form
PlanFile readPlan(const std::string& path);

}  // namespace glint::apps
