#pragma once

#include <string>
#include <vector>

#include "common/tool.h"
#include "glint-plan/map_probe.h"
#include "glint-plan/plan_document.h"

namespace glint::apps {

/// A candidate on the whole map.
struct CheckedOption {
  std::string name;
  Costs costs;
  double seen = 0;
};

/// A material's part of a plan, as it was predicted and as it is.
struct CheckedMaterial {
  const PlannedMaterial* planned = nullptr;
  CheckedOption actual;
  double tolerance = 0;
  std::vector<CheckedOption> sweep;  ///< every candidate that can be made; empty: not asked for

  bool holds() const { return actual.seen <= tolerance; }
  /// The planned cost over that of the cheapest candidate of the sweep that meets the tolerance; 0 without a sweep.
  double overCheapest(Goal goal) const;
};

/// Builds the assets of a plan and measures them on the questions of its scene, at other places than the plan was made with.
/// @param maps   folder of the maps
/// @param sweep  builds and measures every candidate, too
/// @throws Error as openMap; differs if a map is not the one that was planned; failed if an asset cannot be made
std::vector<CheckedMaterial> checkPlan(Tool& tool, const AssetFolder& folder, const PlanFile& plan, const std::string& maps,
                                       bool sweep);

/// Predicted against actual, in words.
std::string checkText(const PlanFile& plan, const std::vector<CheckedMaterial>& checked);
nlohmann::json checkJson(const PlanFile& plan, const std::vector<CheckedMaterial>& checked);

}  // namespace glint::apps
