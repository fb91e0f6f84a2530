#pragma once

#include <nlohmann/json.hpp>
#include <string>
#include <vector>

#include "glint-plan/planner.h"

namespace glint::apps {

/// The programs that build the assets of a plan, each with its inputs and outputs: docs/json/files/jobs.schema.json.
/// @param maps  folder of the maps, as seen from the folder in which the programs will run
nlohmann::ordered_json planJobs(const Tool& tool, const std::vector<MaterialPlan>& plans, const std::string& maps);

}  // namespace glint::apps
