#pragma once

#include <string>

#include "common/files.h"
#include "common/tool.h"
#include "glint-bench/bench_run.h"

namespace glint::apps {

/// The options of glint-bench: maps to measure, tests of stability or a paper's figures to make, or results to show.
class BenchOptions {
 public:
  explicit BenchOptions(Tool& tool);

  /// The results to show as a page; empty: measure.
  const std::string& report() const { return report_; }
  /// Whether to run the tests of stability, which make their own maps.
  bool stability() const { return stability_; }
  /// The paper whose tables and plots to repeat; empty: none.
  const std::string& preset() const { return preset_; }
  const std::string& output() const { return settings_.output; }

  /// How to measure; valid after parsing.
  const BenchSettings& settings() const { return settings_; }

  /// Whether the folder for assets was not named, so that it is removed at the end.
  bool removesAssets() const { return !assets_option_->given(); }

 private:
  void check();
  void checkAction() const;
  void checkNames() const;

  Tool& tool_;
  BenchSettings settings_;
  std::string report_;
  bool stability_ = false;
  std::string preset_;
  const Option* assets_option_ = nullptr;
  const Option* places_option_ = nullptr;
};

}  // namespace glint::apps
