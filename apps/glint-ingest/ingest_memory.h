#pragma once

#include <string>

#include "common/bounded_memory.h"
#include "common/tool.h"

namespace glint::apps {

/// The memory of pixels, normals and bounds of a run of glint-ingest: at most --max-memory, by default half of what there is.
/// What does not fit is in temporary files in the folder of the output, or, where that is in memory (tmpfs) or the output is a
/// pipe, in the folder of TMPDIR, by default /var/tmp.
class IngestMemory {
 public:
  /// @throws Error failed  --max-memory is too small for any image
  IngestMemory(const Tool& tool, const std::string& output);

  /// Warns if temporary files were in memory too.
  void warnAbout(Tool& tool) const;

 private:
  std::string folder_;
  BoundedMemory memory_;
  DefaultMemory default_;
};

}  // namespace glint::apps
