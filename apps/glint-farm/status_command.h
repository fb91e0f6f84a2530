#pragma once

#include "common/files.h"
#include "common/tool.h"

namespace glint::apps {

/// `glint-farm status`: what is made of a manifest.
class FarmStatusCommand {
 public:
  static ToolInfo info();
  explicit FarmStatusCommand(Tool& tool);
  void run();

 private:
  Tool& tool_;
  InputFile manifest_;
};

}  // namespace glint::apps
