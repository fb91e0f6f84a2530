#pragma once

#include "common/files.h"
#include "common/udim_loop.h"
#include "glint-ingest/ingest_options.h"

namespace glint::apps {

/// Makes an asset of each tile of a UDIM set, with margins of texels of its neighbours.
class UdimIngest {
 public:
  UdimIngest(Tool& tool, const InputFile& input, const OutputFile& output, const IngestOptions& options);

  /// Makes all tiles, and sets the result of the run.
  void run() const;

 private:
  Tool& tool_;
  const InputFile& input_;
  const OutputFile& output_;
  const IngestOptions& options_;
  int margin_ = 0;
};

}  // namespace glint::apps
