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

constexpr double kCheckLongestErrors_s = 30, kCheckLongestTime_s = 0.02;

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
    sizes_ = question_.sizes(kQuestionSizes, cap);
    const std::uint64_t other_places = tool.seed() + 1;
    for (std::size_t k = 0; k < sizes_.size(); ++k)
      truths_.push_back(questionTruth(normals, question_, other_places, k, sizes_[k]));
    queries_ = benchQueries(normals, other_places, kTimedQueries, sizes_);
  }

  /// What candidates cost, timed in turns; their errors are not measured.
  std::vector<CheckedOption> costsOf(const std::vector<Candidate>& candidates) {
    std::vector<CheckedOption> options;
    std::list<api::OpenedNdf> ndfs;
    std::vector<AskedNdf> asked;
    for (const Candidate& candidate : candidates) {
      const MadeAsset& made = maker_.make(candidate);
      options.emplace_back();
      options.back().name = candidate.name();
      options.back().costs = {made.bytes + (candidate.takes_normals ? map_.bytes : 0), made.seconds + map_.ingest_s, 0};
      asked.push_back({{&ndfs.emplace_back(maker_.open(candidate))}, queries_});
    }
    const std::vector<double> ns = densityTimes(asked, kCheckLongestTime_s);
    for (std::size_t k = 0; k < options.size(); ++k) options[k].costs.query_ns = ns[k];
    return options;
  }

  /// @param enough  a tolerance: measuring ends at the first size that does not meet it
  PlaceErrors errorsOf(const Candidate& candidate, double enough = std::numeric_limits<double>::infinity()) {
    PlaceErrors largest;
    if (candidate.tool.empty()) return largest;  // the texels themselves
    const api::OpenedNdf ndf = maker_.open(candidate);
    for (PlaceTruth& truth : truths_) {
      PlaceSample sample(truth, ndf);
      PlaceErrors errors = sample.ask(std::min(kUsualPlaces, truth.places()), kCheckLongestErrors_s);
      const bool hopeless = isHopeless(errors, enough);
      if (!hopeless) errors = sample.ask(truth.places(), kCheckLongestErrors_s);
      largest.bias = std::max(largest.bias, errors.bias);
      if (errors.seen > largest.seen) largest.seen = errors.seen, largest.deviation = errors.deviation;
      if (hopeless || largest.seen > enough || largest.bias > kBiasShare * enough) break;
    }
    return largest;
  }

 private:
  const PlanMap& map_;
  MapQuestion question_;
  AssetMaker maker_;
  std::vector<float> sizes_;
  std::list<PlaceTruth> truths_;
  std::vector<BenchQuery> queries_;
};

nlohmann::json costsJson(const Costs& costs, const PlaceErrors& errors) {
  return {{"seen", errors.seen},
          {"bias", errors.bias},
          {"bytes", costs.bytes},
          {"preparation_s", costs.preparation_s},
          {"query_ns", costs.query_ns}};
}

std::string line(const std::string& what, const PlaceErrors& errors, const Costs& costs) {
  return fmt::format("  {:<11} {:>8.3g} {:>8.3g} {:>14} {:>10.3g} {:>12}\n", what, errors.seen, errors.bias,
                     sizeText(costs.bytes), costs.preparation_s, queryTimeText(costs.query_ns));
}

}  // namespace

double CheckedMaterial::overCheapest(Goal goal) const {
  double cheapest = std::numeric_limits<double>::infinity();
  for (const CheckedOption& option : sweep)
    if (holds(option)) cheapest = std::min(cheapest, costOf(option.costs, goal));
  return sweep.empty() ? 0 : costOf(actual.costs, goal) / cheapest;
}

namespace {

void sweepCandidates(MapCheck& check, const std::vector<Candidate>& all, Goal goal, CheckedMaterial& material,
                     std::vector<std::string>& warnings) {
  const double planned = costOf(material.actual.costs, goal);
  std::string done;  // method and pyramid that need no finer setting
  for (const Candidate& candidate : all) {
    const std::string ladder = candidate.method + " of " + candidate.source;
    if (!candidate.source.empty() && ladder == done) continue;
    try {
      CheckedOption option = check.costsOf({candidate}).front();
      const bool dear = costOf(option.costs, goal) > planned;
      if (!dear) option.errors = check.errorsOf(candidate, material.tolerance);
      if (dear || material.holds(option)) done = ladder;
      if (!dear) material.sweep.push_back(std::move(option));
    } catch (const Error& error) {
      warnings.push_back(candidate.name() + " cannot be made: " + error.what());
    }
  }
}

}  // namespace

std::vector<CheckedMaterial> checkPlan(Tool& tool, const AssetFolder& folder, const PlanFile& plan, const std::string& maps,
                                       bool sweep, bool paper) {
  std::vector<CheckedMaterial> checked;
  std::vector<std::string> warnings;  // a warning ends the progress, so warnings come last
  const bake::ProgressFn progress = tool.progress("materials");
  for (const PlannedMaterial& planned : plan.materials) {
    const SceneMaterial& material = plan.scene.materials[planned.index];
    const PlanMap map = openMap(tool, folder, plan.scene, material, maps);
    if (map.hash != planned.map_hash) {
      throw Error(ErrorCode::differs, "plan.map", map.image, "", "is not the map that was planned", "make the plan again");
    }
    const MapQuestion question = questionOf(plan.scene, material, map.normals());
    const std::vector<Candidate> all = planCandidates(question, map.normals().width, map.normals().height);
    const std::vector<Candidate> of_paper = paperCandidates(question);
    std::vector<Candidate> known = all;
    known.insert(known.end(), of_paper.begin(), of_paper.end());
    MapCheck check(tool, folder, map, question, std::move(known));
    std::vector<Candidate> candidates = {planned.candidate};
    if (paper) candidates.push_back(of_paper.back());
    std::vector<CheckedOption> options = check.costsOf(candidates);
    for (std::size_t k = 0; k < options.size(); ++k) options[k].errors = check.errorsOf(candidates[k]);
    checked.push_back({&planned, std::move(options.front()), material.tolerance, {}, {}});
    if (paper) checked.back().paper = std::move(options.back()), checked.back().paper->programs = of_paper;
    if (sweep) sweepCandidates(check, all, plan.scene.goal, checked.back(), warnings);
    if (progress) progress(checked.size(), plan.materials.size());
  }
  for (const std::string& warning : warnings) tool.warn(warning);
  return checked;
}

std::string checkText(const PlanFile& plan, const std::vector<CheckedMaterial>& checked) {
  std::string text;
  for (const CheckedMaterial& material : checked) {
    text +=
        fmt::format("{}: {}\n  {:<11} {:>8} {:>8} {:>14} {:>10} {:>12}\n", plan.scene.materials[material.planned->index].name,
                    material.actual.name, "", "seen", "bias", "size", "prepare, s", "query");
    text += line("predicted", material.planned->errors, material.planned->costs) +
            line("actual", material.actual.errors, material.actual.costs);
    text += fmt::format("  The tolerance of {:g}, of which {:.3g} may be bias, is {}.\n", material.tolerance,
                        kBiasShare * material.tolerance, material.holds() ? "met" : "NOT met");
    if (material.paper) text += line("as in paper", material.paper->errors, material.paper->costs);
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
                            {"predicted", costsJson(material.planned->costs, material.planned->errors)},
                            {"actual", costsJson(material.actual.costs, material.actual.errors)}};
    if (material.paper) {
      entry["paper"] = costsJson(material.paper->costs, material.paper->errors);
      entry["paper"]["name"] = material.paper->name;
      for (const Candidate& made : material.paper->programs)
        entry["paper"]["programs"].push_back({{"tool", made.tool}, {"flags", made.flags}});
    }
    if (!material.sweep.empty()) {
      entry["over_cheapest"] = material.overCheapest(plan.scene.goal);
      entry["sweep"] = nlohmann::json::array();
      for (const CheckedOption& option : material.sweep) {
        entry["sweep"].push_back(costsJson(option.costs, option.errors));
        entry["sweep"].back()["name"] = option.name;
      }
    }
    list.push_back(std::move(entry));
  }
  return {{"materials", std::move(list)}};
}

}  // namespace glint::apps
