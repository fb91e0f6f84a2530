#pragma once

#include <string>

#include "common/bounded_memory.h"
#include "common/tool.h"

namespace glint::apps {

/// The memory of a run whose large arrays need not fit: at most --max-memory, by default half of what there is. It is the default
/// resource as long as this lives. Memory beside large arrays, such as that of the program, comes on top.
///
/// Arrays that do not fit are in temporary files in the folder of the output, or, where that is in memory (tmpfs) or the output is a
/// pipe, in the folder of TMPDIR, by default /var/tmp. Pages of mapped assets count, too, and are given up.
class FiledMemory {
 public:
  /// @param least_bytes  that the run takes whatever is in files
  /// @param what         for the message: "any image"
  /// @throws Error failed  --max-memory is less than `least_bytes`
  FiledMemory(const Tool& tool, const std::string& output, double least_bytes, const std::string& what);

  /// Warns if temporary files were in memory too.
  void warnAbout(Tool& tool) const;

 private:
  std::string folder_;
  BoundedMemory memory_;
  DefaultMemory default_;
};

}  // namespace glint::apps
