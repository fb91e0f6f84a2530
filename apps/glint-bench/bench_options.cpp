#include "glint-bench/bench_options.h"

#include <CLI/CLI.hpp>
#include <algorithm>

#include "glint-bench/candidates.h"
#include "glint/api/alternatives.h"
#include "glint/formats/atomic_file.h"

namespace glint::apps {
namespace {

std::string methodList() {
  const std::vector<std::string> methods = benchMethods();
  return api::alternatives({methods.begin(), methods.end()});
}

}  // namespace

BenchOptions::BenchOptions(Tool& tool) : tool_(tool) {
  tool.parser()
      .add_option("MAP", settings_.maps, "assets of kind normals, from glint-ingest")
      ->expected(0, CLI::detail::expected_max_vector_size);
  tool.option("-o,--output", settings_.output, "results (.json), or with --report a page (.html)").required().unrecorded();
  tool.option("--report", report_, "results to show as a page, instead of measuring").unrecorded();
  tool.option("--only", settings_.only, "methods to measure: " + methodList()).defaultText("all");
  tool.flag("--quick", settings_.quick, "one setting of each method, fewer places");
  places_option_ = &tool.option("--places", settings_.places, "footprints of each size and shape, for errors")
                        .range(1, 100)
                        .defaultText("12, with --quick 4");
  assets_option_ = &tool.option("--assets", settings_.assets, "folder in which the assets stay")
                        .defaultText("none: they are removed")
                        .unrecorded();
  tool.usesSeed();
  tool.addCheck([this] { check(); });
}

void BenchOptions::check() {
  if (report_.empty() == settings_.maps.empty()) {
    throw Error(ErrorCode::usage, "cli.usage", "", "",
                report_.empty() ? "there is nothing to measure" : "maps and --report exclude each other",
                "give maps to measure, or --report RESULTS.json to show them");
  }
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
  const std::vector<std::string> methods = benchMethods();
  for (const std::string& method : settings_.only) {
    if (std::find(methods.begin(), methods.end(), method) != methods.end()) continue;
    throw Error(ErrorCode::usage, "option.choice", "", "--only", "\"" + method + "\" is no method",
                "give some of " + methodList());
  }
  if (settings_.quick) {
    settings_.budget_s = 0.15;
    settings_.longest_run_s = 0.01;
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
