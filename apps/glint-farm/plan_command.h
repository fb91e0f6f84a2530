#pragma once

#include <memory>
#include <string>
#include <vector>

#include "common/files.h"
#include "common/tool.h"

namespace glint::apps {

/// `glint-farm plan`: which assets to make of which maps.
class FarmPlanCommand {
 public:
  static ToolInfo info();
  explicit FarmPlanCommand(Tool& tool);
  /// Writes the manifest.
  void run();

 private:
  void check();

  Tool& tool_;
  std::string folder_, from_, assets_;
  std::vector<std::string> makes_;
  int map_shards_ = 1;
  OutputFile output_;
};

}  // namespace glint::apps
