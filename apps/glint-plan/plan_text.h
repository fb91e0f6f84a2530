#pragma once

#include <string>
#include <vector>

#include "glint-plan/planner.h"

namespace glint::apps {

/// What was understood of a scene, in words.
/// @param questions  of the materials, in their order
std::string sceneText(const Scene& scene, const std::vector<MapQuestion>& questions);

/// Why a candidate was chosen, a sentence each.
std::vector<std::string> reasonsOf(const Scene& scene, const MaterialPlan& plan);

/// What the plan leaves out because the scene never asks for it, a sentence each.
std::vector<std::string> leftOutOf(const Scene& scene, const MaterialPlan& plan);

/// A plan in words.
std::string planText(const Scene& scene, const std::vector<MaterialPlan>& plans);

}  // namespace glint::apps
