#pragma once

#include <string>

#include "common/files.h"
#include "common/tool.h"
#include "glint-pyramid/pyramid_options.h"
#include "glint-pyramid/wave_options.h"
#include "glint/model/ndf_pyramid_shard.h"

namespace glint::apps {

/// The option --region of glint-pyramid.
class RegionOption {
 public:
  /// @param wave  refuses --region under wave optics
  RegionOption(Tool& tool, const WaveOptions& wave);

  bool given() const { return option_->given(); }
  /// Valid after parsing.
  PyramidRegion region() const { return region_; }

 private:
  const Option* option_;
  std::string text_;
  PyramidRegion region_;
};

/// Makes and writes the images of one region of a map of normals.
///
/// Hashes are compared as for every input, but by reading the file in pieces. Values are checked of the texels that the region
/// reaches: others are not touched.
/// @throws Error unsupported for another kind than normals; invalid_input for texels that are no normals
void makeShard(Tool& tool, const InputFile& input, const PyramidOptions& options, const RegionOption& region,
               const OutputFile& output);

}  // namespace glint::apps
