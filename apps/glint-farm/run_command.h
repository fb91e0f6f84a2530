#pragma once

#include <string>
#include <vector>

#include "common/files.h"
#include "common/tool.h"
#include "glint-farm/entry_maker.h"
#include "manifest/manifest.h"

namespace glint::apps {

/// `glint-farm run`: makes what is missing of a manifest.
class FarmRunCommand {
 public:
  static ToolInfo info();
  explicit FarmRunCommand(Tool& tool);
  /// Exit code 4 if an entry could not be made. Ends the process by the signal that stopped it.
  void run();

 private:
  void check();
  /// Flags for the programs: each gets its share of the threads and of the memory.
  std::vector<std::string> flags() const;

  Tool& tool_;
  InputFile manifest_;
  std::string shard_, log_;
  int jobs_ = 1, retries_ = 2;
  bool check_ = false;
  std::size_t shard_index_ = 0, shard_count_ = 1;
};

}  // namespace glint::apps
