#include "glint-plan/actions.h"

#include <algorithm>
#include <filesystem>
#include <nlohmann/json.hpp>

#include "common/files.h"
#include "glint-plan/light_band.h"
#include "glint-plan/plan_check.h"
#include "glint-plan/plan_document.h"
#include "glint-plan/plan_jobs.h"
#include "glint-plan/plan_make.h"
#include "glint-plan/plan_text.h"

namespace glint::apps {
namespace {

namespace fs = std::filesystem;

std::string folderOf(const std::string& file) {
  const std::string folder = fs::path(file).parent_path().string();
  return folder.empty() ? "." : folder;
}

/// A folder as seen from another file's folder.
std::string seenFrom(const std::string& file, const std::string& folder) {
  return fs::proximate(fs::absolute(folder), fs::absolute(folderOf(file))).string();
}

/// glint.mk of the sources that these programs were built in; empty: there is none.
std::string pipelineFile() {
  std::error_code error;
  const fs::path program = fs::read_symlink("/proc/self/exe", error);
  for (const char* way : {"../../pipelines/glint.mk", "../share/glint/glint.mk"}) {
    const fs::path file = fs::weakly_canonical(program.parent_path() / way, error);
    if (!error && fs::exists(file, error)) return file.string();
  }
  return "";
}

std::string explained(Tool& tool, const AssetFolder& folder, const Scene& scene, const std::string& maps) {
  std::vector<MapQuestion> questions;
  for (const SceneMaterial& material : scene.materials)
    questions.push_back(questionOf(scene, material, openMap(tool, folder, scene, material, maps).normals()));
  return sceneText(scene, questions);
}

/// @param rules  whether there are rules for Make
nlohmann::json resultOf(const std::vector<MaterialPlan>& plans, bool rules) {
  nlohmann::json list = nlohmann::json::array();
  for (const MaterialPlan& plan : plans) {
    const PlanOption& choice = plan.choice();
    list.push_back({{"name", plan.material->name},
                    {"asset", choice.candidate.name()},
                    {"seen", choice.errors->seen},
                    {"bias", choice.errors->bias},
                    {"bytes", choice.costs.bytes},
                    {"preparation_s", choice.costs.preparation_s},
                    {"query_ns", choice.costs.query_ns},
                    {"probe_s", plan.probe_s}});
    if (rules) list.back()["file"] = ruleFileOf(plan);
  }
  return {{"materials", std::move(list)}};
}

}  // namespace

void planScene(Tool& tool, const PlanOptions& options) {
  Scene scene = readScene(options.scene());
  const std::string maps = options.maps(folderOf(options.scene()));
  checkMaps(tool, scene, maps);
  const AssetFolder folder = options.assetFolder();
  measureEnvironments(tool, folder, scene, maps);
  if (options.explains()) {
    const std::string text = explained(tool, folder, scene, maps);
    tool.print(text);
    tool.setResult({{"explanation", text}});
    if (options.output().empty() && options.rules().empty() && options.jobs().empty()) return;
  }
  const std::vector<MaterialPlan> plans = Planner(tool, folder, scene, maps, options.cache()).plan();
  // Rules come first: where they cannot be made there is no plan either.
  std::string rules;
  if (!options.rules().empty()) rules = planRules(plans, maps, pipelineFile());
  if (!options.output().empty()) {
    const std::string maps_from_plan = seenFrom(options.output(), maps);
    auto document = planDocument(tool, scene, JsonField::read(options.scene()).value(), maps_from_plan, plans);
    document["jobs"] = planJobs(tool, plans, maps_from_plan)["jobs"];
    writeTextFile(options.output(), document.dump(1) + "\n");
  }
  if (!options.rules().empty()) writeTextFile(options.rules(), rules);
  if (!options.jobs().empty())
    writeTextFile(options.jobs(), planJobs(tool, plans, seenFrom(options.jobs(), maps)).dump(1) + "\n");
  tool.setResult(resultOf(plans, !options.rules().empty()));
  const std::string text = planText(scene, plans);
  if (options.output().empty())
    tool.print(text);
  else
    tool.summary(text);
}

void checkScene(Tool& tool, const PlanOptions& options) {
  PlanFile plan = readPlan(options.check());
  const std::string maps = options.maps(plan.maps);
  checkMaps(tool, plan.scene, maps);
  const AssetFolder folder = options.assetFolder();
  measureEnvironments(tool, folder, plan.scene, maps);
  const std::vector<CheckedMaterial> checked = checkPlan(tool, folder, plan, maps, options.sweeps(), options.asksPaper());
  tool.setResult(checkJson(plan, checked));
  tool.print(checkText(plan, checked));
  const bool holds = std::all_of(checked.begin(), checked.end(), [](const CheckedMaterial& m) { return m.holds(); });
  if (!holds) tool.setExitCode(ErrorCode::differs);
}

}  // namespace glint::apps
