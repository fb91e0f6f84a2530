#include "glint-plan/plan_document.h"

#include <filesystem>

#include "common/files.h"
#include "glint-plan/light_band.h"
#include "glint-plan/plan_candidates.h"
#include "glint-plan/plan_text.h"
#include "glint/model/error.h"

namespace glint::apps {
namespace {

namespace fs = std::filesystem;
using Json = nlohmann::ordered_json;

constexpr const char* kPlanForm = "glint-plan plan 1";

Json costsJson(const Costs& costs) {
  return {{"bytes", costs.bytes}, {"preparation_s", costs.preparation_s}, {"query_ns", costs.query_ns}};
}

Json candidateJson(const Candidate& candidate) {
  return {{"name", candidate.name()},
          {"method", candidate.method},
          {"setting", candidate.setting},
          {"tool", candidate.tool},
          {"flags", candidate.flags},
          {"source", candidate.source},
          {"takes_normals", candidate.takes_normals}};
}

Json optionJson(const PlanOption& option) {
  Json json = {{"name", option.candidate.name()}};
  if (!option.failure.empty()) json["failure"] = option.failure;
  if (option.costed) json["costs"] = costsJson(option.costs);
  if (option.errors) json[option.at_least ? "seen_at_least" : "seen"] = option.errors->seen;
  return json;
}

Json materialJson(const Scene& scene, const MaterialPlan& plan) {
  const MapQuestion& question = plan.question;
  const PlaceErrors& errors = *plan.choice().errors;
  Json predicted = {{"seen", errors.seen}, {"seen_deviation", errors.deviation}, {"bias", errors.bias}};
  predicted.update(costsJson(plan.choice().costs));
  Json considered = Json::array();
  for (const PlanOption& option : plan.options) considered.push_back(optionJson(option));
  return {{"name", plan.material->name},
          {"map",
           {{"file", plan.material->map},
            {"hash", plan.map.hash},
            {"width", plan.map.normals().width},
            {"height", plan.map.normals().height},
            {"probe_edge_texels", plan.probe_edge}}},
          {"question",
           {{"smallest_texels", question.footprints.smallest},
            {"largest_texels", question.footprints.largest},
            {"sigma_r", plan.material->sigma_r},
            {"light_deg", question.light_deg},
            {"sh_order", shOrder(question.light_deg, plan.material->sigma_r)},
            {"tolerance", plan.material->tolerance}}},
          {"asset", candidateJson(plan.choice().candidate)},
          {"predicted", std::move(predicted)},
          {"reasons", reasonsOf(scene, plan)},
          {"left_out", leftOutOf(scene, plan)},
          {"considered", std::move(considered)}};
}

Candidate candidateOf(const Json& json) {
  return {json.at("method").get<std::string>(), json.at("setting").get<std::string>(),
          json.at("tool").get<std::string>(),   json.at("flags").get<std::vector<std::string>>(),
          json.at("source").get<std::string>(), json.at("takes_normals").get<bool>()};
}

PlannedMaterial plannedOf(const Json& json, const Scene& scene) {
  PlannedMaterial material;
  const auto name = json.at("name").get<std::string>();
  while (material.index < scene.materials.size() && scene.materials[material.index].name != name) ++material.index;
  if (material.index == scene.materials.size()) throw std::out_of_range(name);
  material.map_hash = json.at("map").at("hash").get<std::string>();
  material.candidate = candidateOf(json.at("asset"));
  const Json& predicted = json.at("predicted");
  material.errors = {predicted.at("seen").get<double>(), predicted.at("seen_deviation").get<double>(),
                     predicted.at("bias").get<double>(), 0};
  material.costs = {predicted.at("bytes").get<double>(), predicted.at("preparation_s").get<double>(),
                    predicted.at("query_ns").get<double>()};
  return material;
}

}  // namespace

nlohmann::ordered_json planDocument(const Tool& tool, const Scene& scene, const nlohmann::json& scene_document,
                                    const std::string& maps, const std::vector<MaterialPlan>& plans) {
  Json materials = Json::array();
  Costs total;
  for (const MaterialPlan& plan : plans) {
    materials.push_back(materialJson(scene, plan));
    total.bytes += plan.choice().costs.bytes;
    total.preparation_s += plan.choice().costs.preparation_s;
    total.query_ns = std::max(total.query_ns, plan.choice().costs.query_ns);
  }
  return {{"schema", kPlanForm},     {"generator", tool.generator()},     {"seed", tool.seed()},      {"maps", maps},
          {"scene", scene_document}, {"materials", std::move(materials)}, {"total", costsJson(total)}};
}

PlanFile readPlan(const std::string& path) {
  const JsonField document = JsonField::read(path);
  document.member("schema", "give a file that glint-plan SCENE -o FILE made").word({kPlanForm});
  PlanFile plan;
  plan.path = path;
  plan.scene = sceneOf(document.member("scene", "make the plan again"), path);
  try {
    const Json value = document.value();
    plan.maps = (fs::path(path).parent_path() / value.at("maps").get<std::string>()).string();
    for (const Json& material : value.at("materials")) plan.materials.push_back(plannedOf(material, plan.scene));
  } catch (const std::exception&) {
    throw Error(ErrorCode::invalid_input, "plan.form", path, "", "lacks a part of a plan",
                "make it again with glint-plan SCENE -o FILE");
  }
  return plan;
}

}  // namespace glint::apps
