#include "glint-plan/plan_jobs.h"

#include <filesystem>
#include <map>
#include <string_view>

namespace glint::apps {
namespace {

namespace fs = std::filesystem;
using Json = nlohmann::ordered_json;

constexpr const char* kJobsForm = "glint-plan jobs 1";
constexpr const char* kJobsFolder = "assets/";

/// Collects jobs, each once.
class Jobs {
 public:
  /// @return the output of the job of this program, input and flags
  std::string add(const std::string& program, const std::string& input, const std::vector<std::string>& flags,
                  const std::string& output) {
    std::string key = program + " " + input;
    for (const std::string& flag : flags) key += " " + flag;
    if (const auto made = made_.find(key); made != made_.end()) return made->second;
    const std::string file = kJobsFolder + output;
    Json command = {program, input, "-o", file};
    for (const std::string& flag : flags) command.push_back(flag);
    Json after = Json::array();
    if (const auto maker = makers_.find(input); maker != makers_.end()) after.push_back(maker->second);
    jobs_.push_back({{"id", output}, {"command", command}, {"inputs", {input}}, {"outputs", {file}}, {"after", after}});
    makers_[file] = output;
    return made_[key] = file;
  }

  const Json& all() const { return jobs_; }

 private:
  Json jobs_ = Json::array();
  std::map<std::string, std::string> made_, makers_;
};

/// The name of a material as a part of the name of a file.
std::string fileName(std::string name) {
  constexpr std::string_view kPlain = "abcdefghijklmnopqrstuvwxyzABCDEFGHIJKLMNOPQRSTUVWXYZ0123456789._-";
  for (char& c : name)
    if (kPlain.find(c) == std::string_view::npos) c = '_';
  return name;
}

}  // namespace

nlohmann::ordered_json planJobs(const Tool& tool, const std::vector<MaterialPlan>& plans, const std::string& maps) {
  Jobs jobs;
  Json materials = Json::array();
  std::size_t number = 0;
  for (const MaterialPlan& plan : plans) {
    // The number keeps names apart that differ in other signs alone.
    const std::string name = std::to_string(number++) + "." + fileName(plan.material->name);
    std::string normals = (fs::path(maps) / plan.material->map).lexically_normal().string();
    if (!plan.material->map.ends_with(".glint"))
      normals = jobs.add("glint-ingest", normals, plan.material->ingest_flags, name + ".normals.glint");
    const Candidate& chosen = plan.choice().candidate;
    std::string asset = normals;
    if (const Candidate* source = plan.choiceSource())
      asset = jobs.add(source->tool, asset, source->flags, name + ".pyramid.glint");
    if (!chosen.tool.empty()) asset = jobs.add(chosen.tool, asset, chosen.flags, name + ".asset.glint");
    Json material = {{"name", plan.material->name}, {"asset", asset}};
    if (chosen.takes_normals) material["normals"] = normals;
    materials.push_back(std::move(material));
  }
  return {{"schema", kJobsForm}, {"generator", tool.generator()}, {"materials", materials}, {"jobs", jobs.all()}};
}

}  // namespace glint::apps
