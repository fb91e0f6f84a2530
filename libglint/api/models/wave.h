#pragma once

#include "glint/api/models/levels.h"
#include "glint/query/wave_cp_ndf.h"
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

template <>
struct NdfTraits<AnisotropicNdf<WaveCpNdf>> {
  using Asset = WaveCp;
  static constexpr std::string_view kKind = formats::kKindName<Asset>;

  static AnisotropicNdf<WaveCpNdf> open(const NdfSource<WaveCp>& source) {
    return {WaveCpNdf(source.asset, source.options.interpolation, source.options.pixels), source.options.footprint_parts};
  }
  static NdfInfo info(const NdfSource<WaveCp>& source) { return levelsInfo(source.asset.shape, false); }
  static MapSlopes slopes(const WaveCp& wave) { return wave.shape.slopes; }
  static constexpr bool kPacks = false;
};

}  // namespace glint::api
