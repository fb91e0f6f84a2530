#pragma once

#include <string>

#include "common/files.h"
#include "common/tool.h"
#include "glint-pyramid/pyramid_options.h"
#include "glint/bake/wave/wave_pyramid.h"
#include "glint/formats/asset_reader.h"

namespace glint::apps {

enum class Optics { geometric, wave };

/// The options of glint-pyramid that wave optics adds.
class WaveOptions {
 public:
  /// @param pyramid  options that both share
  WaveOptions(Tool& tool, const PyramidOptions& pyramid);

  Optics optics() const { return optics_; }

  /// Valid after parsing. @throws Error usage for wavelengths that are none
  bake::WaveOptions values() const;

 private:
  const PyramidOptions& pyramid_;
  Optics optics_ = Optics::geometric;
  bake::WaveOptions values_;
  std::string wavelengths_ = "8";
};

/// Makes and writes the pyramid of an asset of heights. Warns of what the answer cannot have: diffraction between texels, one
/// wavelength, or footprints below the coherence area.
/// @throws Error unsupported for another kind than heights, saying how to get heights
void makeWavePyramid(Tool& tool, const formats::Asset& asset, const InputFile& input, const WaveOptions& options,
                     const formats::Provenance& provenance, const OutputFile& output);

}  // namespace glint::apps
