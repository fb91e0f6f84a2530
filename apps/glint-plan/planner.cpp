#include "glint-plan/planner.h"

#include <fmt/format.h>

#include <algorithm>
#include <chrono>
#include <cmath>
#include <limits>
#include <map>
#include <set>
#include <string>
#include <utility>

#include "glint-plan/plan_candidates.h"
#include "glint-plan/totals.h"

namespace glint::apps {
namespace {

constexpr double kNoLimit = std::numeric_limits<double>::infinity();

/// The tighter of the limits of a material and of its scene.
double limitOf(const std::optional<double>& own, const std::optional<double>& scene) {
  return std::min(own.value_or(kNoLimit), scene.value_or(kNoLimit));
}

/// One of the three budgets.
struct BudgetKind {
  const char* name;
  std::optional<double> Budgets::*limit;
  double Costs::*cost;
  std::string (*text)(double);
};

const BudgetKind kBudgets[] = {
    {"bytes", &Budgets::bytes, &Costs::bytes, sizeText},
    {"preparation_s", &Budgets::preparation_s, &Costs::preparation_s, [](double s) { return fmt::format("{:.3g} s", s); }},
    {"query_ns", &Budgets::query_ns, &Costs::query_ns, queryTimeText},
};

/// Sorts options by cost, with the unmeasured ones at the end.
void sortByCost(MaterialPlan& plan, Goal goal) {
  const std::string chosen = plan.choice().candidate.name();
  const auto rank = [&](const PlanOption& o) { return std::pair(!o.costed, o.cost(goal)); };
  std::stable_sort(plan.options.begin(), plan.options.end(),
                   [&](const PlanOption& a, const PlanOption& b) { return rank(a) < rank(b); });
  plan.chosen = 0;
  while (plan.choice().candidate.name() != chosen) ++plan.chosen;
}

/// Settings of each method that is compressed from a pyramid, from coarse to fine.
std::vector<std::vector<PlanOption*>> laddersOf(MaterialPlan& plan, const PlanOption& pyramid) {
  std::vector<std::vector<PlanOption*>> ladders;
  for (PlanOption& option : plan.options) {
    if (option.candidate.source != pyramid.candidate.name()) continue;
    if (ladders.empty() || ladders.back().front()->candidate.method != option.candidate.method) ladders.emplace_back();
    ladders.back().push_back(&option);
  }
  return ladders;
}

/// The coarsest setting that may meet a tolerance: the errors of the pyramid and of the compression add up like independent errors.
/// @param own  seen error of the pyramid
std::size_t firstGuess(const std::vector<PlanOption*>& ladder, double own, double tolerance) {
  const double left = std::sqrt(std::max(0.0, tolerance * tolerance - own * own));
  std::size_t guess = 0;
  while (guess + 1 < ladder.size() && toleranceOf(ladder[guess]->candidate) > left) ++guess;
  return guess;
}

/// Why nothing is compressed from a pyramid that does not do.
std::string failureOfPyramid(const PlanOption& pyramid) {
  if (!pyramid.failure.empty()) return "its pyramid cannot be made: " + pyramid.failure;
  return fmt::format("the pyramid that it is made of has a seen error of {:.2g} and a bias of {:.2g} already",
                     pyramid.errors->seen, pyramid.errors->bias);
}

}  // namespace

double costOf(const Costs& costs, Goal goal) {
  if (goal == Goal::query_ns) return costs.query_ns;
  return goal == Goal::bytes ? costs.bytes : costs.preparation_s;
}

const Candidate* MaterialPlan::choiceSource() const {
  if (choice().candidate.source.empty()) return nullptr;
  const auto found = std::find_if(options.begin(), options.end(), [&](const PlanOption& option) {
    return option.candidate.name() == choice().candidate.source;
  });
  return found == options.end() ? nullptr : &found->candidate;
}

/// A material while it is planned.
struct Planner::Work {
  MaterialPlan plan;
  std::unique_ptr<ProbeCache> cache;
  std::unique_ptr<MapProbe> probe;
  bool found = false;  ///< whether the plan has a choice
};

MapQuestion questionOf(const Scene& scene, const SceneMaterial& material, const NormalMap& map) {
  MapQuestion question;
  question.footprints = footprintsOf(scene, material, map.width);
  question.sigma_r = static_cast<float>(material.sigma_r);
  question.light_deg = scene.sharpest().smooth_deg;
  return question;
}

Planner::Planner(Tool& tool, const AssetFolder& folder, const Scene& scene, std::string maps, std::string cache)
    : tool_(tool), folder_(folder), scene_(scene), maps_(std::move(maps)), cache_(std::move(cache)) {}

Planner::~Planner() = default;

void Planner::open(const SceneMaterial& material) {
  works_.push_back(std::make_unique<Work>());
  Work& work = *works_.back();
  work.plan.material = &material;
  work.plan.map = openMap(tool_, folder_, scene_, material, maps_);
  work.plan.question = questionOf(scene_, material, work.plan.map.normals());
}

void Planner::prepare(Work& work) {
  work.cache = std::make_unique<ProbeCache>(cache_, work.plan.map.hash);
  work.probe = std::make_unique<MapProbe>(tool_, folder_, work.plan.map, work.plan.question, *work.cache);
  work.plan.probe_edge = work.probe->edge();
  for (const Candidate& candidate : work.probe->candidates()) {
    PlanOption option;
    option.candidate = candidate;
    work.plan.options.push_back(std::move(option));
  }
}

bool Planner::cost(Work& work, PlanOption& option) {
  if (option.costed || !option.failure.empty()) return option.costed;
  try {
    option.costs = work.probe->costs(static_cast<std::size_t>(&option - work.plan.options.data()));
    option.costed = true;
  } catch (const Error& error) {
    option.failure = error.what();
  }
  return option.costed;
}

bool Planner::meets(Work& work, PlanOption& option) {
  if (!option.costed) return false;
  const double tolerance = work.plan.material->tolerance;
  if (!option.errors && option.failure.empty()) {
    try {
      option.errors = work.probe->errors(static_cast<std::size_t>(&option - work.plan.options.data()), tolerance);
      option.at_least = !surelyWithin(*option.errors, tolerance);
    } catch (const Error& error) {
      option.failure = error.what();
    }
  }
  return option.failure.empty() && !option.at_least;
}

bool Planner::affordable(const Work& work, const PlanOption& option) const {
  return std::all_of(std::begin(kBudgets), std::end(kBudgets), [&](const BudgetKind& kind) {
    return option.costs.*kind.cost <= limitOf(work.plan.material->budgets.*kind.limit, scene_.budgets.*kind.limit);
  });
}

bool Planner::choose(Work& work) {
  std::vector<std::size_t> order;
  for (std::size_t k = 0; k < work.plan.options.size(); ++k)
    if (work.plan.options[k].costed && affordable(work, work.plan.options[k])) order.push_back(k);
  std::stable_sort(order.begin(), order.end(), [&](std::size_t a, std::size_t b) {
    return work.plan.options[a].cost(scene_.goal) < work.plan.options[b].cost(scene_.goal);
  });
  const auto first = std::find_if(order.begin(), order.end(), [&](std::size_t k) { return meets(work, work.plan.options[k]); });
  work.found = first != order.end();
  if (work.found) work.plan.chosen = *first;
  return work.found;
}

std::size_t Planner::measureLadder(Work& work, const std::vector<PlanOption*>& ladder, std::size_t first, bool all) {
  const auto isDear = [&](std::size_t k) {
    return !all && work.found && ladder[k]->costed && ladder[k]->cost(scene_.goal) >= work.plan.choice().cost(scene_.goal);
  };
  const auto isGood = [&](std::size_t k) { return cost(work, *ladder[k]) && !isDear(k) && meets(work, *ladder[k]); };
  std::size_t k = first;
  bool good = isGood(k);
  // Coarser settings while this one is too dear, then finer ones until one is good enough, and again coarser ones while they are.
  // Where it is far too dear, the coarsest one tells whether any is not.
  constexpr double kFar = 2;
  while (!good && isDear(k) && k > 0) {
    const bool far = ladder[k]->cost(scene_.goal) > kFar * work.plan.choice().cost(scene_.goal);
    k = far ? 0 : k - 1;
    good = isGood(k);
  }
  while (!good && !isDear(k) && k + 1 < ladder.size()) good = isGood(++k);
  while (good && k > 0 && isGood(k - 1)) --k;
  if (good) choose(work);
  return k;
}

bool Planner::isSettled(const Work& work, const std::vector<PlanOption*>& ladder, std::size_t last, double own) const {
  const SceneMaterial& material = *work.plan.material;
  const bool times_count =
      scene_.goal == Goal::query_ns || limitOf(material.budgets.query_ns, scene_.budgets.query_ns) < kNoLimit;
  const PlanOption& option = *ladder[last];
  if (times_count || !option.costed) return false;
  const bool good = option.errors && !option.at_least && affordable(work, option);
  if (last == 0) return good || (work.found && option.cost(scene_.goal) >= work.plan.choice().cost(scene_.goal));
  // Independent errors add up as squares: without that of the pyramid the coarser setting would be too coarse still.
  const std::optional<PlaceErrors>& coarser = ladder[last - 1]->errors;
  return good && coarser && coarser->seen * coarser->seen - own * own > material.tolerance * material.tolerance;
}

bool Planner::isCheaper(Work& work, PlanOption& option) {
  return cost(work, option) && work.found && option.cost(scene_.goal) < work.plan.choice().cost(scene_.goal);
}

void Planner::measureCompressed(Work& work, bool all) {
  std::map<std::string, std::size_t> last;  // setting that the ladder of a method ended with, on images of fewer pixels
  std::set<std::string> settled;            // methods that more pixels help only where they make smaller files
  std::set<std::string> closed;             // methods that more pixels do not help
  for (PlanOption& pyramid : work.plan.options) {
    if (pyramid.candidate.tool != "glint-pyramid") continue;
    std::vector<std::vector<PlanOption*>> ladders = laddersOf(work.plan, pyramid);
    std::erase_if(ladders, [&](const auto& ladder) { return closed.contains(ladder.front()->candidate.method); });
    const bool usable = !ladders.empty() && meets(work, pyramid);
    for (const std::vector<PlanOption*>& ladder : ladders) {
      if (!usable) {
        for (PlanOption* option : ladder) option->failure = failureOfPyramid(pyramid);
        continue;
      }
      const std::string& method = ladder.front()->candidate.method;
      const auto known = last.find(method);
      const std::size_t first =
          known == last.end() ? firstGuess(ladder, pyramid.errors->seen, work.plan.material->tolerance) : known->second;
      if (!all && settled.contains(method) && !isCheaper(work, *ladder[first])) {
        closed.insert(method);
        continue;
      }
      last[method] = measureLadder(work, ladder, first, all);
      if (isSettled(work, ladder, last[method], pyramid.errors->seen)) settled.insert(method);
    }
  }
}

void Planner::refuse(Work& work) {
  // The option that would do if one budget alone were larger, and else the one that is nearest to all budgets.
  const SceneMaterial& material = *work.plan.material;
  std::string text, fields, needs;
  for (const BudgetKind& kind : kBudgets) {
    const double own = (material.budgets.*kind.limit).value_or(kNoLimit);
    const double limit = std::min(own, (scene_.budgets.*kind.limit).value_or(kNoLimit));
    if (limit == kNoLimit) continue;
    const PlanOption* least = nullptr;
    for (PlanOption& option : work.plan.options) {
      if (!meets(work, option)) continue;
      if (least == nullptr || option.costs.*kind.cost < least->costs.*kind.cost) least = &option;
    }
    const std::string field = (own <= limit ? material.path + "." : std::string()) + "budgets." + kind.name;
    fields += (fields.empty() ? "" : ", ") + field;
    if (least != nullptr && least->costs.*kind.cost > limit) {
      text += (text.empty() ? "" : "; ") +
              fmt::format("{} of {} is less than the {} of {}, the least with which a method meets the tolerance of {}", field,
                          kind.text(limit), kind.text(least->costs.*kind.cost), least->candidate.name(), material.tolerance);
      needs += (needs.empty() ? "" : ", ") + fmt::format("{} of {}", kind.name, kind.text(least->costs.*kind.cost));
    }
  }
  const std::string what = "no plan for " + material.name + ": ";
  if (!text.empty())
    throw Error(ErrorCode::failed, "plan.budget", scene_.file, "", what + text, "allow " + needs + ", or a larger tolerance");
  std::string each;
  for (PlanOption& option : work.plan.options) {
    if (!meets(work, option)) continue;
    each += (each.empty() ? "" : "; ") + fmt::format("{} takes {}, {:.3g} s and {}", option.candidate.name(),
                                                     sizeText(option.costs.bytes), option.costs.preparation_s,
                                                     queryTimeText(option.costs.query_ns));
  }
  throw Error(
      ErrorCode::failed, "plan.budget", scene_.file, "",
      what + fields + " can be met one by one, but not together, with a tolerance of " + fmt::format("{}", material.tolerance),
      "choose budgets of one method: " + each);
}

void Planner::fitTotals() {
  const auto within = [&](const BudgetKind& kind) {
    double sum = 0;
    for (const auto& work : works_) sum += work->plan.choice().costs.*kind.cost;
    return sum <= (scene_.budgets.*kind.limit).value_or(kNoLimit);
  };
  if (works_.size() < 2 || (within(kBudgets[0]) && within(kBudgets[1]))) return;
  std::vector<std::vector<Share>> shares;
  std::vector<std::vector<std::size_t>> places;
  for (auto& work : works_) {
    measureCompressed(*work, true);
    shares.emplace_back(), places.emplace_back();
    for (std::size_t k = 0; k < work->plan.options.size(); ++k) {
      PlanOption& option = work->plan.options[k];
      if (!option.costed || !affordable(*work, option) || !meets(*work, option)) continue;
      shares.back().push_back({option.cost(scene_.goal), option.costs.bytes, option.costs.preparation_s});
      places.back().push_back(k);
    }
  }
  const auto chosen =
      cheapestWithin(shares, scene_.budgets.bytes.value_or(kNoLimit), scene_.budgets.preparation_s.value_or(kNoLimit));
  if (chosen) {
    for (std::size_t m = 0; m < works_.size(); ++m) works_[m]->plan.chosen = places[m][(*chosen)[m]];
    return;
  }
  std::string needs;
  for (const BudgetKind& kind : {kBudgets[0], kBudgets[1]}) {
    if (!(scene_.budgets.*kind.limit)) continue;
    double least = 0;
    for (std::size_t m = 0; m < works_.size(); ++m) {
      double of_material = kNoLimit;
      for (const std::size_t k : places[m]) of_material = std::min(of_material, works_[m]->plan.options[k].costs.*kind.cost);
      least += of_material;
    }
    needs += (needs.empty() ? "" : "; ") + fmt::format("budgets.{}: the materials need {} together at least, of {}", kind.name,
                                                       kind.text(least), kind.text(*(scene_.budgets.*kind.limit)));
  }
  throw Error(ErrorCode::failed, "plan.budget", scene_.file, "budgets", "no plan for all materials together; " + needs,
              "allow more, or larger tolerances");
}

std::vector<MaterialPlan> Planner::plan() {
  using Clock = std::chrono::steady_clock;
  for (const SceneMaterial& material : scene_.materials) open(material);
  const bake::ProgressFn progress = tool_.progress("materials");
  std::size_t done = 0;
  for (auto& work : works_) {
    const Clock::time_point start = Clock::now();
    prepare(*work);
    try {
      for (PlanOption& option : work->plan.options)
        if (option.candidate.source.empty()) cost(*work, option);
      choose(*work);
      measureCompressed(*work, false);
      if (!choose(*work)) measureCompressed(*work, true);
      if (!choose(*work)) refuse(*work);
    } catch (const Error&) {
      work->cache->save();
      throw;
    }
    work->cache->save();
    work->plan.probe_s = std::chrono::duration<double>(Clock::now() - start).count();
    if (progress) progress(++done, works_.size());
  }
  fitTotals();
  std::vector<MaterialPlan> plans;
  for (auto& work : works_) {
    work->cache->save();
    sortByCost(work->plan, scene_.goal);
    plans.push_back(std::move(work->plan));
  }
  works_.clear();
  return plans;
}

}  // namespace glint::apps
