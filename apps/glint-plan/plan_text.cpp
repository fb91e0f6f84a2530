#include "glint-plan/plan_text.h"

#include <fmt/format.h>

#include <algorithm>
#include <set>
#include <utility>

#include "glint-plan/plan_candidates.h"

namespace glint::apps {
namespace {

std::string goalText(Goal goal) {
  if (goal == Goal::bytes) return "the fewest bytes";
  return goal == Goal::query_ns ? "the quickest density" : "the shortest preparation";
}

std::string budgetText(const Budgets& budgets) {
  std::string text;
  const auto add = [&](const std::string& part) { text += (text.empty() ? "" : ", ") + part; };
  if (budgets.bytes) add(sizeText(*budgets.bytes));
  if (budgets.preparation_s) add(fmt::format("{:g} s to prepare", *budgets.preparation_s));
  if (budgets.query_ns) add(queryTimeText(*budgets.query_ns) + " for a density");
  return text.empty() ? "no limit" : "at most " + text;
}

std::string lightText(const SceneLight& light) {
  if (light.type == "environment")
    return light.smooth_deg > 0 ? fmt::format("an environment that changes over {:.3g} degrees and more", light.smooth_deg)
                                : "an environment with sharp lights";
  if (!(light.smooth_deg > 0)) return fmt::format("a {} light, which is sharp", light.type);
  return fmt::format("a {} light {:g} degrees wide", light.type, light.smooth_deg);
}

const Candidate* pyramidOf(const MaterialPlan& plan) {
  const Candidate& chosen = plan.choice().candidate;
  return chosen.tool == "glint-pyramid" ? &chosen : plan.choiceSource();
}

/// Why an option that is cheaper than the choice is not chosen.
std::string objectionTo(const PlanOption& option, double tolerance) {
  const std::string name = option.candidate.name();
  if (!option.errors || surelyWithin(*option.errors, tolerance))
    return fmt::format("{} would be over a budget: {}, {:.3g} s to prepare, {} for a density.", name,
                       sizeText(option.costs.bytes), option.costs.preparation_s, queryTimeText(option.costs.query_ns));
  if (surelySeen(*option.errors) <= tolerance)
    return fmt::format("{} would be cheaper, but its bias is {:.2g}.", name, option.errors->bias);
  return fmt::format("{} would be cheaper, but its seen error is {:.2g}, and up to {:.2g} at other places.", name,
                     option.errors->seen, surelySeen(*option.errors));
}

/// Objections to the cheapest option of each method that is cheaper than the choice: those that were measured first.
std::vector<std::string> objectionsIn(const MaterialPlan& plan) {
  std::vector<std::string> objections;
  std::set<std::string> methods = {plan.choice().candidate.method};
  for (const bool measured : {true, false}) {
    for (std::size_t k = 0; k < plan.chosen; ++k) {
      const PlanOption& option = plan.options[k];
      if (!option.costed || option.errors.has_value() != measured || !methods.insert(option.candidate.method).second) continue;
      objections.push_back(objectionTo(option, plan.material->tolerance));
    }
  }
  return objections;
}

}  // namespace

std::string sceneText(const Scene& scene, const std::vector<MapQuestion>& questions) {
  std::string text =
      fmt::format("The plan takes {}, with {} for the scene.\n", goalText(scene.goal), budgetText(scene.budgets));
  if (const auto& c = scene.camera) {
    text += fmt::format(
        "The camera sees {:g} degrees in {} columns, from {:g} to {:g} units away (a unit is {:g} m), with {} sample{} of a "
        "pixel.\n",
        c->field_of_view_deg, c->columns, c->nearest, c->farthest, scene.unit_m, c->samples, c->samples == 1 ? "" : "s");
  }
  for (const SceneLight& light : scene.lights) text += "Light: " + lightText(light) + ".\n";
  text += "Errors are seen under " + lightText(scene.sharpest()) + ".\n";
  for (std::size_t k = 0; k < scene.materials.size(); ++k) {
    const SceneMaterial& material = scene.materials[k];
    text += fmt::format(
        "{} is {}: footprints of {:.3g} to {:.3g} texels{}, facets blurred by {:g}, a seen error of at most {:g}, {} for it.\n",
        material.name, material.map, questions[k].footprints.smallest, questions[k].footprints.largest,
        material.footprints ? "" : " from the camera", material.sigma_r, material.tolerance, budgetText(material.budgets));
  }
  return text;
}

std::vector<std::string> reasonsOf(const Scene& scene, const MaterialPlan& plan) {
  const PlanOption& choice = plan.choice();
  std::vector<std::string> reasons;
  const auto compared = std::count_if(plan.options.begin(), plan.options.end(), [](const PlanOption& o) { return o.costed; });
  if (choice.candidate.tool.empty()) {
    reasons.push_back("The texels themselves have no error.");
  } else {
    const PlaceErrors& errors = *choice.errors;
    reasons.push_back(fmt::format(
        "Its seen error is {:.2g}, and up to {:.2g} at other places; the tolerance is {:g}. Its bias is {:.2g} of "
        "at most {:.2g}.",
        errors.seen, surelySeen(errors), plan.material->tolerance, errors.bias, kBiasShare * plan.material->tolerance));
  }
  reasons.push_back(fmt::format("Of {} candidates that were measured it has {} within the tolerance and the budgets.", compared,
                                goalText(scene.goal)));
  for (std::string& objection : objectionsIn(plan)) reasons.push_back(std::move(objection));
  return reasons;
}

std::vector<std::string> leftOutOf(const Scene& scene, const MaterialPlan& plan) {
  std::vector<std::string> out;
  const Candidate& chosen = plan.choice().candidate;
  const FootprintRange& range = plan.question.footprints;
  if (const std::string finest = flagOf(chosen, "--finest"); !finest.empty() && finest != "0") {
    out.push_back(
        fmt::format("Levels of moments before level {}: no footprint is smaller than {:.3g} texels.", finest, range.smallest));
  }
  const Candidate* pyramid = pyramidOf(plan);
  if (pyramid == nullptr) return out;
  out.push_back(fmt::format("Levels finer than a stride of {} texels: no footprint is smaller than {:.3g} texels.",
                            flagOf(*pyramid, "--stride"), range.smallest));
  out.push_back(
      fmt::format("Levels after the first {}, but for the mean of the map: no footprint is larger than {:.3g} texels.",
                  flagOf(*pyramid, "--levels"), range.largest));
  if (!chosen.takes_normals)
    out.push_back("The map itself at run time: no footprint is so small that single texels answer it.");
  if (flagOf(*pyramid, "--resolution") != "256") {
    out.push_back(fmt::format("Images of more than {} pixels: facets are blurred by {:g}, and the sharpest is {}.",
                              flagOf(*pyramid, "--resolution"), plan.material->sigma_r, lightText(scene.sharpest())));
  }
  return out;
}

std::string planText(const Scene& scene, const std::vector<MaterialPlan>& plans) {
  std::string text;
  for (const MaterialPlan& plan : plans) {
    const PlanOption& choice = plan.choice();
    text += fmt::format("{}: {}; seen error {:.2g} of at most {:g}, {}, {:.2g} s to prepare, {} for a density\n",
                        plan.material->name, choice.candidate.name(), choice.errors->seen, plan.material->tolerance,
                        sizeText(choice.costs.bytes), choice.costs.preparation_s, queryTimeText(choice.costs.query_ns));
    for (const std::string& reason : reasonsOf(scene, plan)) text += "  " + reason + "\n";
    for (const std::string& part : leftOutOf(scene, plan)) text += "  Left out. " + part + "\n";
  }
  return text;
}

}  // namespace glint::apps
