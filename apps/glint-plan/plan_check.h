#pragma once

#include <optional>
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
  PlaceErrors errors;               ///< at the sizes with the largest
  std::vector<Candidate> programs;  ///< of the paper's setting: those that make the asset of the map, in their order
};

/// A material's part of a plan, as it was predicted and as it is.
struct CheckedMaterial {
  const PlannedMaterial* planned = nullptr;
  CheckedOption actual;
  double tolerance = 0;
  std::optional<CheckedOption> paper;  ///< the setting of Deng 2022; nothing: not asked for
  std::vector<CheckedOption> sweep;    ///< candidates that could be cheaper than the planned one; empty: not asked for

  /// Whether the seen error is within the tolerance, and the bias within its share of it.
  bool holds() const { return holds(actual); }
  bool holds(const CheckedOption& option) const {
    return option.errors.seen <= tolerance && option.errors.bias <= kBiasShare * tolerance;
  }
  /// The planned cost over that of the cheapest candidate of the sweep that meets the tolerance; 0 without a sweep.
  double overCheapest(Goal goal) const;
};

/// Builds the assets of a plan and measures them on the questions of its scene, at other places than the plan was made with.
/// @param maps   folder of the maps
/// @param sweep  builds every candidate, too, and measures those that cost no more than the plan. The settings of a compression end
///               at the first that holds: finer ones take more
/// @param paper  builds and measures the setting of Deng 2022, too
/// @throws Error as openMap; differs if a map is not the one that was planned; failed if an asset cannot be made
std::vector<CheckedMaterial> checkPlan(Tool& tool, const AssetFolder& folder, const PlanFile& plan, const std::string& maps,
                                       bool sweep, bool paper);

/// Predicted against actual, in words.
std::string checkText(const PlanFile& plan, const std::vector<CheckedMaterial>& checked);
nlohmann::json checkJson(const PlanFile& plan, const std::vector<CheckedMaterial>& checked);

}  // namespace glint::apps
