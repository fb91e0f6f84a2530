#pragma once

#include <nlohmann/json_fwd.hpp>

#include "common/files.h"
#include "common/udim_loop.h"
#include "glint-compress/compress_options.h"

namespace glint::apps {

/// Compresses the pyramid of one map, or of one tile of a UDIM set, and writes it.
/// @return the report of the run
nlohmann::json compressMap(Tool& tool, const CompressOptions& options, const MapFiles& files, const OutputFile& output);

}  // namespace glint::apps
