#pragma once

#include <string>
#include <vector>

#include "glint-plan/planner.h"

namespace glint::apps {

/// Rules for Make that build exactly the assets of a plan, over pipelines/glint.mk.
/// @param maps      folder of the maps, relative to where Make runs
/// @param pipeline  glint.mk; empty: who runs Make has to say where it is
/// @throws Error unsupported if glint.mk cannot build two of the assets side by side, or a name cannot stand in a Makefile
std::string planRules(const std::vector<MaterialPlan>& plans, const std::string& maps, const std::string& pipeline);

/// The file that these rules make for the queries of a material: "car.tucker.glint".
std::string ruleFileOf(const MaterialPlan& plan);

}  // namespace glint::apps
