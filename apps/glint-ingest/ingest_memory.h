#pragma once

#include <string>

#include "common/bounded_memory.h"
#include "common/tool.h"

namespace glint::apps {

/// The memory of pixels, normals and bounds of a run of glint-ingest: at most --max-memory, by default half of what there is. What
/// does not fit is in temporary files in the folder of the output.
class IngestMemory {
 public:
  /// @throws Error failed  --max-memory is too small for any image
  IngestMemory(const Tool& tool, const std::string& output);

 private:
  BoundedMemory memory_;
  DefaultMemory default_;
};

}  // namespace glint::apps
