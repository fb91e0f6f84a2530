#pragma once

#include "common/files.h"
#include "common/udim_loop.h"
#include "glint-ingest/ingest_options.h"

namespace glint::apps {

/// Texts of the help for the input and the output.
inline constexpr const char* kUdimImages = "image of normals or heights, or those of a UDIM set: 'name.<UDIM>.exr'";
inline constexpr const char* kUdimMaps =
    "asset (.glint) of normals or heights; of a UDIM set, one for each tile: 'name.<UDIM>.map.glint'";

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
