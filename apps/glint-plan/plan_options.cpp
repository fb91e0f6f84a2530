#include "glint-plan/plan_options.h"

#include <filesystem>

#include "common/files.h"

namespace glint::apps {

namespace fs = std::filesystem;

PlanOptions::PlanOptions(Tool& tool) : tool_(tool) {
  tool.option("SCENE", scene_, "what the scene will ask (.json): docs/json/files/scene.schema.json").unrecorded();
  tool.option("-o,--output", output_, "plan (.json)").defaultText("none: the plan is only printed").unrecorded();
  tool.option("--maps", maps_, "folder of the maps that the scene names").defaultText("that of the scene").unrecorded();
  tool.option("--make", rules_, "Makefile that builds the assets of the plan, over pipelines/glint.mk")
      .defaultText("none")
      .unrecorded();
  tool.option("--jobs", jobs_,
              "manifest for a farm: programs with inputs and outputs (.json): docs/json/files/jobs.schema.json")
      .defaultText("none")
      .unrecorded();
  tool.option("--cache", cache_, "folder in which measurements of maps are kept for later plans")
      .defaultText("none")
      .unrecorded();
  tool.flag("--explain", explain_, "say in words what was understood of the scene; without -o, --make and --jobs that is all");
  tool.option("--check", check_,
              "instead of a scene: a plan to build and to measure; ends with exit code 7 if it does not hold")
      .defaultText("none")
      .unrecorded();
  tool.flag(
      "--sweep", sweep_,
      "with --check: build every candidate, measure those that take no more, and say how far the plan is from the cheapest");
  tool.flag("--paper", paper_,
            "with --check: build and measure the setting of Deng 2022, too: stride 32, overlap 1, CP of rank 16");
  assets_option_ =
      &tool.option("--assets", assets_, "folder in which assets stay").defaultText("none: they are removed").unrecorded();
  tool.usesSeed();
  tool.addCheck([this] { checkFiles(); });
}

void PlanOptions::checkFiles() {
  const auto refuse = [](const char* option, const std::string& what, const std::string& remedy) {
    throw Error(ErrorCode::usage, "cli.usage", "", option, what, remedy);
  };
  if (scene_.empty() == check_.empty()) {
    refuse("SCENE", scene_.empty() ? "there is nothing to plan" : "a scene and --check exclude each other",
           "give a scene to plan, or --check PLAN.json");
  }
  if (sweep_ && check_.empty())
    refuse("--sweep", "only a check of a plan can sweep", "give --check PLAN.json, or leave out --sweep");
  if (paper_ && check_.empty())
    refuse("--paper", "only a check of a plan builds assets", "give --check PLAN.json, or leave out --paper");
  if (!check_.empty() && !(output_.empty() && rules_.empty() && jobs_.empty() && cache_.empty() && !explain_))
    refuse("--check", "a check makes no plan", "leave out -o, --make, --jobs, --cache and --explain");
  const std::string& input = scene_.empty() ? check_ : scene_;
  checkRegular(input);
  tool_.addInput(input);
  if (!output_.empty()) checkOutput(tool_, output_, OutputFormat::plan), tool_.addOutput(output_);
  if (!rules_.empty()) checkOutput(tool_, rules_, OutputFormat::plan_rules), tool_.addOutput(rules_);
  if (!jobs_.empty()) checkOutput(tool_, jobs_, OutputFormat::plan), tool_.addOutput(jobs_);
}

AssetFolder PlanOptions::assetFolder() const {
  if (assets_option_->given()) return AssetFolder(assets_, false);
  // Beside the plan, so that large assets are on a disk that was meant for them.
  return AssetFolder::temporary((output_.empty() ? fs::temp_directory_path() / "glint-plan" : fs::path(output_)).string());
}

}  // namespace glint::apps
