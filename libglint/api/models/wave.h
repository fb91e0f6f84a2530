#pragma once

#include "glint/api/models/levels.h"
#include "glint/query/wave_ndf.h"

namespace glint::api {

template <>
struct NdfTraits<AnisotropicNdf<WaveNdf>> {
  using Asset = WavePyramid;
  static constexpr std::string_view kKind = formats::kKindName<Asset>;

  static AnisotropicNdf<WaveNdf> open(const NdfSource<WavePyramid>& source) {
    return {WaveNdf(source.asset, source.options.interpolation, source.options.pixels), source.options.footprint_parts};
  }
  static NdfInfo info(const NdfSource<WavePyramid>& source) { return levelsInfo(source.asset.grey.shape, false); }
  static MapSlopes slopes(const WavePyramid& wave) { return wave.grey.shape.slopes; }
  static constexpr bool kPacks = false;
};

}  // namespace glint::api
