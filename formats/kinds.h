#pragma once

#include <string_view>
#include <variant>

#include "glint/model/bin_map.h"
#include "glint/model/displacement.h"
#include "glint/model/histogram_sat.h"
#include "glint/model/ndf_cp.h"
#include "glint/model/ndf_pyramid.h"
#include "glint/model/ndf_pyramid_shard.h"
#include "glint/model/normal_map.h"
#include "glint/model/sh.h"
#include "glint/model/slope_moments.h"
#include "glint/model/tiny_example.h"
#include "glint/model/wang_images.h"
#include "glint/model/wang_tiles.h"
#include "glint/model/wave_cp.h"
#include "glint/model/wave_pyramid.h"

namespace glint::formats {

/// The struct of any kind of asset: the one list of kinds, in the order of their names. To add a kind, add its struct and its
/// name here, and describe the kind in a file of formats/kinds/.
using AnyAsset = std::variant<BinMap, Displacement, HeightMap, HistogramSat, NdfCp, NdfPyramid, NdfPyramidShard, NormalMap,
                              ShLight, ShLobes, SlopeMoments, TinyExample, WangCp, WangPyramid, WangTiles, WaveCp, WavePyramid>;

/// Name of the kind whose assets are of struct `Model`, as files and messages have it, e.g. "bin-map".
template <class Model>
inline constexpr std::string_view kKindName = {};
template <>
inline constexpr std::string_view kKindName<BinMap> = "bin-map";
template <>
inline constexpr std::string_view kKindName<Displacement> = "displacement";
template <>
inline constexpr std::string_view kKindName<HeightMap> = "heights";
template <>
inline constexpr std::string_view kKindName<HistogramSat> = "histogram-sat";
template <>
inline constexpr std::string_view kKindName<NdfCp> = "ndf-cp";
template <>
inline constexpr std::string_view kKindName<NdfPyramid> = "ndf-pyramid";
template <>
inline constexpr std::string_view kKindName<NdfPyramidShard> = "ndf-pyramid-shard";
template <>
inline constexpr std::string_view kKindName<NormalMap> = "normals";
template <>
inline constexpr std::string_view kKindName<ShLight> = "sh-light";
template <>
inline constexpr std::string_view kKindName<ShLobes> = "sh-lobes";
template <>
inline constexpr std::string_view kKindName<SlopeMoments> = "slope-moments";
template <>
inline constexpr std::string_view kKindName<TinyExample> = "tiny-example";
template <>
inline constexpr std::string_view kKindName<WangCp> = "wang-cp";
template <>
inline constexpr std::string_view kKindName<WangPyramid> = "wang-pyramid";
template <>
inline constexpr std::string_view kKindName<WangTiles> = "wang-tiles";
template <>
inline constexpr std::string_view kKindName<WaveCp> = "wave-cp";
template <>
inline constexpr std::string_view kKindName<WavePyramid> = "wave-pyramid";

}  // namespace glint::formats
