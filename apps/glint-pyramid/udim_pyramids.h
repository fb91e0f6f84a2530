#pragma once

#include "common/files.h"
#include "common/tool.h"
#include "glint-pyramid/pyramid_options.h"
#include "glint-pyramid/wave_options.h"

namespace glint::apps {

/// Texts of the help for the input and the output.
inline constexpr const char* kPyramidInput =
    "asset of kind normals, or with --optics wave of kind heights, from glint-ingest; or of kind wang-tiles, from glint-wang; "
    "or the normals of a UDIM set, 'name.<UDIM>.map.glint'";
inline constexpr const char* kPyramidOutput =
    "asset (.glint) of kind ndf-pyramid, wang-pyramid or wave-pyramid; with <UDIM>, one for each tile; with --region "
    "ndf-pyramid-shard";

/// Makes a pyramid of each tile of a UDIM set, margins included, or of the file of one tile.
/// @return false for an input that is neither, of which nothing is made
/// @throws Error unsupported for waves
bool makeUdimPyramids(Tool& tool, const InputFile& input, const OutputFile& output, const PyramidOptions& options,
                      const WaveOptions& wave);

}  // namespace glint::apps
