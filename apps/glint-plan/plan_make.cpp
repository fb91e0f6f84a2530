#include "glint-plan/plan_make.h"

#include <fmt/format.h>

#include <filesystem>
#include <map>
#include <set>

#include "glint-plan/plan_candidates.h"
#include "glint/model/error.h"

namespace glint::apps {
namespace {

namespace fs = std::filesystem;

/// The part of glint.mk's names for an asset of a candidate: "pyramid" in NAME.pyramid.glint; empty: the map.
std::string suffixOf(const Candidate& candidate) {
  if (candidate.tool.empty()) return "";
  if (candidate.tool == "glint-compress") return candidate.method;
  return candidate.tool.substr(candidate.tool.find('-') + 1);
}

std::string upper(std::string text) {
  for (char& c : text) c = static_cast<char>(std::toupper(static_cast<unsigned char>(c)));
  return text;
}

/// Flags for Make, without --method, which glint.mk gives.
std::string flagsText(const std::vector<std::string>& flags) {
  std::string text;
  for (std::size_t k = 0; k < flags.size(); ++k) {
    if (flags[k] == "--method") {
      ++k;
      continue;
    }
    text += (text.empty() ? "" : " ") + flags[k];
  }
  return text;
}

void checkName(const MaterialPlan& plan, const std::string& name) {
  constexpr const char* kPlain = "abcdefghijklmnopqrstuvwxyzABCDEFGHIJKLMNOPQRSTUVWXYZ0123456789._-/";
  if (name.find_first_not_of(kPlain) == std::string::npos) return;
  throw Error(ErrorCode::unsupported, "plan.make", "", plan.material->path + ".map",
              "\"" + name + "\" has signs that these rules cannot hold",
              "give the file and its folders a name of letters, digits, . _ and -");
}

/// Collects variables and targets, and refuses two values for one.
class Rules {
 public:
  void add(const MaterialPlan& plan) {
    const fs::path file(plan.material->map);
    checkName(plan, plan.material->map);
    const std::string name = file.stem().string();
    if (file.has_parent_path()) {
      throw Error(ErrorCode::unsupported, "plan.make", "", plan.material->path + ".map",
                  "glint.mk takes all maps from one folder, and this one is in " + file.parent_path().string(),
                  "put the maps of a scene into one folder");
    }
    set(plan, "file of " + name, plan.material->map);
    if (file.extension() == ".glint") assets_[name] = plan.material->map;
    set(plan, "GLINT_INGEST_FLAGS_" + name, flagsText(plan.material->ingest_flags));
    const Candidate& chosen = plan.choice().candidate;
    if (const Candidate* source = plan.choiceSource()) addFlags(plan, name, *source);
    addFlags(plan, name, chosen);
    targets_.insert(ruleFileOf(plan));
    if (chosen.takes_normals) targets_.insert(name + ".glint");
  }

  std::string text(const std::string& maps, const std::string& pipeline) const {
    std::string text = "# Made by glint-plan: builds the assets of a plan. Run: make -f THIS_FILE\n";
    text += fmt::format("GLINT_MAPS := {}\nGLINT_OUT ?= assets\nGLINT_SETTINGS := $(lastword $(MAKEFILE_LIST))\n", maps);
    text += pipeline.empty() ? "$(if $(GLINT_MK),,$(error say where pipelines/glint.mk is: make GLINT_MK=... ))\n"
                             : fmt::format("GLINT_MK ?= {}\n", pipeline);
    // The general flags of glint.mk, such as a rank, exclude a tolerance.
    std::set<std::string> general;
    for (const auto& [name, value] : values_)
      if (name.starts_with("GLINT_")) general.insert(name.substr(0, name.find("_FLAGS_") + 6));
    for (const std::string& name : general) text += name + " :=\n";
    for (const auto& [name, value] : values_)
      if (name.starts_with("GLINT_") && !value.empty()) text += name + " := " + value + "\n";
    text += "\n.DEFAULT_GOAL := plan\n.PHONY: plan\ninclude $(GLINT_MK)\n\nplan:";
    for (const std::string& target : targets_) text += " $(GLINT_OUT)/" + target;
    text += "\n";
    for (const auto& [name, file] : assets_)
      text += fmt::format("\n$(GLINT_OUT)/{0}.glint: $(GLINT_MAPS)/{1} | $(GLINT_OUT)\n\tcp $< $@\n", name, file);
    return text;
  }

 private:
  void addFlags(const MaterialPlan& plan, const std::string& name, const Candidate& candidate) {
    if (candidate.tool.empty()) return;
    set(plan, "GLINT_" + upper(suffixOf(candidate)) + "_FLAGS_" + name, flagsText(candidate.flags));
  }

  void set(const MaterialPlan& plan, const std::string& name, const std::string& value) {
    const auto [place, is_new] = values_.emplace(name, value);
    if (is_new || place->second == value) return;
    throw Error(ErrorCode::unsupported, "plan.make", "", plan.material->path,
                "needs other settings than another material for an asset of the same name: " + name + " is \"" + value +
                    "\" and \"" + place->second + "\"",
                "copy the map under a second name, for one of the materials");
  }

  std::map<std::string, std::string> values_, assets_;
  std::set<std::string> targets_;
};

}  // namespace

std::string ruleFileOf(const MaterialPlan& plan) {
  const std::string suffix = suffixOf(plan.choice().candidate);
  return fs::path(plan.material->map).stem().string() + (suffix.empty() ? "" : "." + suffix) + ".glint";
}

std::string planRules(const std::vector<MaterialPlan>& plans, const std::string& maps, const std::string& pipeline) {
  Rules rules;
  for (const MaterialPlan& plan : plans) rules.add(plan);
  return rules.text(maps.empty() ? "." : maps, pipeline);
}

}  // namespace glint::apps
