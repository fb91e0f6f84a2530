#pragma once

#include <memory>
#include <optional>
#include <string>
#include <vector>

#include "common/tool.h"
#include "glint-plan/map_probe.h"

namespace glint::apps {

/// The cost that a goal makes small.
double costOf(const Costs& costs, Goal goal);

/// A candidate of a material, as predicted.
struct PlanOption {
  Candidate candidate;
  Costs costs;
  std::optional<PlaceErrors> errors;  ///< nothing: not measured, because a cheaper one was good enough
  bool at_least = false;              ///< errors are these or more: other sizes were not measured
  bool costed = false;                ///< whether the costs are known
  std::string failure;                ///< why it was not measured; may be empty
  double cost(Goal goal) const { return costOf(costs, goal); }
};

/// A material's part of a plan.
struct MaterialPlan {
  const SceneMaterial* material = nullptr;
  MapQuestion question;
  PlanMap map;
  int probe_edge = 0;               ///< texels; 0: the whole map was probed
  std::vector<PlanOption> options;  ///< cheapest first
  std::size_t chosen = 0;
  double probe_s = 0;  ///< time of the probe

  const PlanOption& choice() const { return options[chosen]; }
  /// The candidate whose asset is the input of the choice; nullptr: the map.
  const Candidate* choiceSource() const;
};

/// Plans the materials of a scene.
class Planner {
 public:
  Planner(Tool& tool, const AssetFolder& folder, const Scene& scene, std::string maps, std::string cache);
  ~Planner();

  /// The cheapest candidates that meet the tolerances within the budgets.
  /// @throws Error failed if there are none: names the budget, and says what would meet it
  std::vector<MaterialPlan> plan();

 private:
  struct Work;
  void open(const SceneMaterial& material);
  void prepare(Work& work);
  /// Sets the choice, if an option is good enough.
  bool choose(Work& work);
  /// Measures what is compressed from the pyramids that are good enough themselves, until the cheapest setting of each method is known.
  /// @param all  also when it costs more than the choice so far
  void measureCompressed(Work& work, bool all);
  /// Measures settings of one method, compressed from one pyramid, until the coarsest one that is good enough is known.
  /// @param first  number of the setting to begin with
  /// @return number of the setting that it ended with
  std::size_t measureLadder(Work& work, const std::vector<PlanOption*>& ladder, std::size_t first, bool all);
  /// Whether images of more pixels allow a method no coarser setting. They may still take fewer bytes at the same setting.
  /// @param last  number of the setting that a ladder ended with
  /// @param own   seen error of the pyramid
  bool isSettled(const Work& work, const std::vector<PlanOption*>& ladder, std::size_t last, double own) const;
  /// Whether an option costs less than the choice so far.
  bool isCheaper(Work& work, PlanOption& option);
  /// Measures the costs of an option, unless they are known.
  /// @return whether it can be made
  bool cost(Work& work, PlanOption& option);
  /// Whether an option whose costs are known meets the tolerance. Measures its errors, unless they are known.
  bool meets(Work& work, PlanOption& option);
  bool affordable(const Work& work, const PlanOption& option) const;
  [[noreturn]] void refuse(Work& work);
  void fitTotals();

  Tool& tool_;
  const AssetFolder& folder_;
  const Scene& scene_;
  std::string maps_, cache_;
  std::vector<std::unique_ptr<Work>> works_;
};

/// The question that a scene asks of a material's map.
MapQuestion questionOf(const Scene& scene, const SceneMaterial& material, const NormalMap& map);

}  // namespace glint::apps
