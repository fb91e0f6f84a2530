#pragma once

#include <string>

#include "common/tool.h"
#include "measure/asset_folder.h"

namespace glint::apps {

/// The command line of glint-plan.
class PlanOptions {
 public:
  explicit PlanOptions(Tool& tool);

  const std::string& scene() const { return scene_; }
  const std::string& check() const { return check_; }
  const std::string& output() const { return output_; }
  const std::string& rules() const { return rules_; }
  const std::string& jobs() const { return jobs_; }
  const std::string& cache() const { return cache_; }
  bool explains() const { return explain_; }
  bool sweeps() const { return sweep_; }
  bool asksPaper() const { return paper_; }
  /// The folder of maps: the one that was given, or else this one.
  std::string maps(const std::string& other) const { return maps_.empty() ? other : maps_; }
  /// The folder for assets, which is removed unless it was given.
  /// @throws Error io
  AssetFolder assetFolder() const;

 private:
  void checkFiles();

  Tool& tool_;
  std::string scene_, check_, output_, rules_, jobs_, cache_, maps_, assets_;
  bool explain_ = false, sweep_ = false, paper_ = false;
  Option* assets_option_ = nullptr;
};

}  // namespace glint::apps
