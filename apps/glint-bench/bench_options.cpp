#include "glint-bench/bench_options.h"

#include <CLI/CLI.hpp>
#include <algorithm>

#include "glint-bench/presets/preset_run.h"
#include "glint-bench/stability/stability_run.h"
#include "glint/api/alternatives.h"
#include "glint/formats/atomic_file.h"
#include "measure/candidates.h"

namespace glint::apps {
namespace {

std::string listOf(const std::vector<std::string>& names) { return api::alternatives({names.begin(), names.end()}); }

}  // namespace

BenchOptions::BenchOptions(Tool& tool) : tool_(tool) {
  tool.parser()
      .add_option("MAP", settings_.maps, "assets of kind normals, from glint-ingest")
      ->expected(0, CLI::detail::expected_max_vector_size);
  tool.option("-o,--output", settings_.output, "results (.json), or with --report a page (.html)").required().unrecorded();
  tool.option("--report", report_, "results to show as a page, instead of measuring").unrecorded();
  tool.flag("--stability", stability_,
            "instead of maps of yours: run the tests of what each method does where it fails, on maps of their own");
  tool.option(
          "--preset", preset_,
          "instead of maps of yours: repeat the tables and plots of a paper on maps of the same kind: " + listOf(presetNames()))
      .defaultText("none");
  tool.option("--only", settings_.only,
              "methods to measure: " + listOf(benchMethods()) + "; with --stability tests: " + listOf(stabilityNames()))
      .defaultText("all");
  tool.flag("--quick", settings_.quick,
            "one setting of each method, fewer places; with --stability or --preset fewer and smaller maps");
  places_option_ = &tool.option("--places", settings_.places, "footprints of each size and shape, for errors")
                        .range(1, 100)
                        .defaultText("12, with --quick 4");
  assets_option_ = &tool.option("--assets", settings_.assets, "folder in which the assets stay")
                        .defaultText("none: they are removed")
                        .unrecorded();
  tool.usesSeed();
  tool.addCheck([this] { check(); });
}

void BenchOptions::checkAction() const {
  const int actions = int{!report_.empty()} + int{!settings_.maps.empty()} + int{stability_} + int{!preset_.empty()};
  if (actions != 1) {
    throw Error(ErrorCode::usage, "cli.usage", "", "",
                actions == 0 ? "there is nothing to measure" : "maps, --stability, --preset and --report exclude each other",
                "give maps to measure, or --stability, or --preset, or --report RESULTS.json to show results");
  }
  const auto refuse = [](const char* option, const std::string& what) {
    throw Error(ErrorCode::usage, "cli.usage", "", option, what, std::string("leave out ") + option);
  };
  if (settings_.maps.empty() && places_option_->given()) refuse("--places", "only measurements of maps have places to choose");
  if (settings_.maps.empty() && assets_option_->given()) refuse("--assets", "only assets of maps of yours stay");
  if (!preset_.empty() && !settings_.only.empty()) refuse("--only", "a preset is made as a whole");
}

void BenchOptions::checkNames() const {
  const std::vector<std::string> papers = presetNames();
  if (!preset_.empty() && std::find(papers.begin(), papers.end(), preset_) == papers.end()) {
    throw Error(ErrorCode::usage, "option.choice", "", "--preset", "\"" + preset_ + "\" is no preset",
                "give " + listOf(papers));
  }
  const std::vector<std::string> names = stability_ ? stabilityNames() : benchMethods();
  for (const std::string& name : settings_.only) {
    if (std::find(names.begin(), names.end(), name) != names.end()) continue;
    throw Error(ErrorCode::usage, "option.choice", "", "--only", "\"" + name + "\" is no " + (stability_ ? "test" : "method"),
                "give some of " + listOf(names));
  }
}

void BenchOptions::check() {
  checkAction();
  if (!report_.empty()) {
    checkRegular(report_);
    tool_.addInput(report_);
    checkOutput(tool_, settings_.output, OutputFormat::page);
    tool_.addOutput(settings_.output);
    return;
  }
  for (const std::string& map : settings_.maps) {
    checkRegular(map);
    tool_.addInput(map);
  }
  checkNames();
  if (settings_.quick) {
    settings_.budget_s = 0.15;
    settings_.longest_run_s = 0.01;
    settings_.picture_budget_s = 2;
    settings_.picture_pixels = 48;
    settings_.picture_sizes = 3;  // the exact pictures of wide footprints take longest
    if (!places_option_->given()) settings_.places = 4;
  }
  checkOutput(tool_, settings_.output, OutputFormat::results);
  if (formats::findOutput(settings_.output).kind == formats::OutputTarget::Kind::stream) {
    throw Error(ErrorCode::usage, "output.regular", settings_.output, "",
                "is no file, and results are read and written many times", "name a file");
  }
  tool_.addOutput(settings_.output);
  if (!assets_option_->given()) settings_.assets = settings_.output + ".assets";
}

}  // namespace glint::apps
