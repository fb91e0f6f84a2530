#include "glint-plan/plan_check.h"

#include <fmt/format.h>

#include <algorithm>
#include <limits>
#include <list>
#include <nlohmann/json.hpp>

#include "glint-plan/plan_candidates.h"
#include "measure/bench_times.h"

namespace glint::apps {
namespace {

constexpr int kCheckedSizes = 6, kCheckedPlaces = 12, kCheckedTruths = 48, kCheckedQueries = 4096;
constexpr double kCheckErrorBudget_s = 3, kCheckLongestTime_s = 0.02;

/// Measures candidates on one whole map.
class MapCheck {
 public:
  MapCheck(Tool& tool, const AssetFolder& folder, const PlanMap& map, const MapQuestion& question, std::vector<Candidate> all)
      : map_(map),
        question_(question),
        maker_(tool, folder, map.hash, "check " + question.key(), map.path, std::move(all), question.sigma_r) {
    const NormalMap& normals = map_.normals();
    constexpr double kWidest = 0.125;  // of the map, as in the bench: larger footprints look like the mean of the map
    const double cap = std::max(question_.footprints.smallest, kWidest * std::min(normals.width, normals.height));
    sizes_ = question_.sizes(kCheckedSizes, cap);
    const std::uint64_t other_places = tool.seed() + 1;
    sets_ = questionSets(other_places, sizes_, kCheckedPlaces, kCheckedTruths);
    for (const FootprintSet& set : sets_) truths_.emplace_back(normals, set, question_.sigma_r, question_.light_deg);
    queries_ = benchQueries(normals, other_places, kCheckedQueries, sizes_);
  }

  CheckedOption measure(const Candidate& candidate) {
    const MadeAsset made = maker_.make(candidate);
    const api::OpenedNdf ndf = maker_.open(candidate);
    CheckedOption option;
    option.name = candidate.name();
    option.costs = {made.bytes + (candidate.takes_normals ? map_.bytes : 0), made.seconds + map_.ingest_s,
                    densityTime(ndf, queries_, kCheckLongestTime_s)};
    if (candidate.tool.empty()) return option;  // the texels themselves
    std::vector<float> first;
    for (const SetTruth& truth : truths_)
      option.seen = std::max(option.seen, truth.errorsOf(ndf, kCheckErrorBudget_s, first)["seen"].get<double>());
    return option;
  }

  const std::vector<Candidate>& all() const { return maker_.all(); }

 private:
  const PlanMap& map_;
  MapQuestion question_;
  AssetMaker maker_;
  std::vector<float> sizes_;
  std::vector<FootprintSet> sets_;
  std::list<SetTruth> truths_;
  std::vector<BenchQuery> queries_;
};

double costOf(const Costs& costs, Goal goal) {
  if (goal == Goal::query_ns) return costs.query_ns;
  return goal == Goal::bytes ? costs.bytes : costs.preparation_s;
}

nlohmann::json costsJson(const Costs& costs, double seen) {
  return {{"seen", seen}, {"bytes", costs.bytes}, {"preparation_s", costs.preparation_s}, {"query_ns", costs.query_ns}};
}

std::string line(const std::string& what, double seen, const Costs& costs) {
  return fmt::format("  {:<10} {:>8.3g} {:>14} {:>10.3g} {:>12}\n", what, seen, sizeText(costs.bytes), costs.preparation_s,
                     queryTimeText(costs.query_ns));
}

}  // namespace

double CheckedMaterial::overCheapest(Goal goal) const {
  double cheapest = std::numeric_limits<double>::infinity();
  for (const CheckedOption& option : sweep)
    if (option.seen <= tolerance) cheapest = std::min(cheapest, costOf(option.costs, goal));
  return sweep.empty() ? 0 : costOf(actual.costs, goal) / cheapest;
}

std::vector<CheckedMaterial> checkPlan(Tool& tool, const AssetFolder& folder, const PlanFile& plan, const std::string& maps,
                                       bool sweep) {
  std::vector<CheckedMaterial> checked;
  const bake::ProgressFn progress = tool.progress("materials");
  for (const PlannedMaterial& planned : plan.materials) {
    const SceneMaterial& material = plan.scene.materials[planned.index];
    const PlanMap map = openMap(tool, folder, plan.scene, material, maps);
    if (map.hash != planned.map_hash) {
      throw Error(ErrorCode::differs, "plan.map", map.image, "", "is not the map that was planned", "make the plan again");
    }
    const MapQuestion question = questionOf(plan.scene, material, map.normals());
    MapCheck check(tool, folder, map, question, planCandidates(question, map.normals().width, map.normals().height));
    checked.push_back({&planned, check.measure(planned.candidate), material.tolerance, {}});
    for (const Candidate& candidate : check.all()) {
      if (!sweep) break;
      try {
        checked.back().sweep.push_back(check.measure(candidate));
      } catch (const Error& error) {
        tool.warn(candidate.name() + " cannot be made: " + error.what());
      }
    }
    if (progress) progress(checked.size(), plan.materials.size());
  }
  return checked;
}

std::string checkText(const PlanFile& plan, const std::vector<CheckedMaterial>& checked) {
  std::string text;
  for (const CheckedMaterial& material : checked) {
    text += fmt::format("{}: {}\n  {:<10} {:>8} {:>14} {:>10} {:>12}\n", plan.scene.materials[material.planned->index].name,
                        material.actual.name, "", "seen", "size", "prepare, s", "query");
    text += line("predicted", material.planned->seen, material.planned->costs) +
            line("actual", material.actual.seen, material.actual.costs);
    text += fmt::format("  The tolerance of {:g} is {}.\n", material.tolerance, material.holds() ? "met" : "NOT met");
    if (!material.sweep.empty()) {
      text += fmt::format("  It takes {:.3g} times the {} of the cheapest candidate that meets the tolerance.\n",
                          material.overCheapest(plan.scene.goal), goalName(plan.scene.goal));
    }
  }
  return text;
}

nlohmann::json checkJson(const PlanFile& plan, const std::vector<CheckedMaterial>& checked) {
  nlohmann::json list = nlohmann::json::array();
  for (const CheckedMaterial& material : checked) {
    nlohmann::json entry = {{"name", plan.scene.materials[material.planned->index].name},
                            {"asset", material.actual.name},
                            {"tolerance", material.tolerance},
                            {"holds", material.holds()},
                            {"predicted", costsJson(material.planned->costs, material.planned->seen)},
                            {"actual", costsJson(material.actual.costs, material.actual.seen)}};
    if (!material.sweep.empty()) {
      entry["over_cheapest"] = material.overCheapest(plan.scene.goal);
      entry["sweep"] = nlohmann::json::array();
      for (const CheckedOption& option : material.sweep) {
        entry["sweep"].push_back(costsJson(option.costs, option.seen));
        entry["sweep"].back()["name"] = option.name;
      }
    }
    list.push_back(std::move(entry));
  }
  return {{"materials", std::move(list)}};
}

}  // namespace glint::apps
