#pragma once

// Private to formats/: what several kinds have.

#include <cfloat>
#include <cmath>
#include <string_view>
#include <vector>

#include "glint/formats/findings.h"
#include "glint/formats/kinds/fields.h"
#include "glint/formats/rules.h"
#include "glint/model/map_slopes.h"
#include "glint/model/ndf_pyramid.h"

namespace glint::formats {

inline constexpr double kMaxMapSize = 1 << 20;  // texels along an axis; keeps every product of sizes far below 2^63
inline constexpr Range kMapSize = {1, kMaxMapSize};
inline constexpr Range kPositive = {FLT_MIN, FLT_MAX};
inline constexpr Range kDiskUnits = {FLT_MIN, 1};  // of roughness

/// width, height and texel_size_um of a map.
void describeMap(Fields auto& fields, auto& map) {
  fields.integer("width", map.width, kMapSize, "texel", "width of the map");
  fields.integer("height", map.height, kMapSize, "texel", "height of the map");
  fields.real("texel_size_um", map.texel_size_um, {0, FLT_MAX}, "um", "width of a texel; 0 when unknown");
}

/// width and height of the normal map that an asset was made from.
void describeMapSize(Fields auto& fields, auto& asset) {
  fields.integer("width", asset.width, kMapSize, "texel", "width of the normal map");
  fields.integer("height", asset.height, kMapSize, "texel", "height of the normal map");
}

void describeSlopes(Fields auto& fields, auto& slopes) {
  constexpr double kMaxSlope = 1e6;  // float normals inside the unit disk have slopes up to 4096
  constexpr double kMaxCovariance = kMaxSlope * kMaxSlope;
  fields.reals("slope_mean", "2", {&slopes.mean.x, &slopes.mean.y}, {-kMaxSlope, kMaxSlope}, "1",
               "mean slope of the map's texels along u and v");
  fields.reals("slope_covariance", "3", {&slopes.covariance.xx, &slopes.covariance.xy, &slopes.covariance.yy},
               {-kMaxCovariance, kMaxCovariance}, "1", "uu, uv, vv of the slopes of the map's texels");
}

/// Whether moments are those of slopes that a normal map can have: finite, and of the range of describeSlopes.
inline bool areUsable(const MapSlopes& s) {
  constexpr float kMostSlope = 1e6f, kMostCovariance = 1e12f;
  const Covariance& c = s.covariance;
  const auto within = [](float x, float most) { return std::abs(x) <= most; };
  return within(s.mean.x, kMostSlope) && within(s.mean.y, kMostSlope) && within(c.xx, kMostCovariance) &&
         within(c.xy, kMostCovariance) && within(c.yy, kMostCovariance);
}

/// What all pyramids of NDF images share.
void describeShape(Fields auto& fields, auto& shape) {
  describeMapSize(fields, shape);
  fields.integer("resolution", shape.resolution, {kBlockSize, 1024}, "pixel",
                 "pixels of an NDF image along each axis; a multiple of 16");
  fields.real("sigma_r", shape.sigma_r, kDiskUnits, "1", "intrinsic roughness: standard deviation in disk units");
  fields.choice("surface", shape.surface, "flat|smooth", "normals between texel centres");
  fields.choice("boundary", shape.boundary, "wrap|clamp", "what lies beyond the border of the map");
  fields.realUnless(1, "overlap", shape.overlap, {1, kMostOverlap}, "1",
                    "footprints in a stride along each axis; 1 where it is absent");
  fields.integer("level_count", shape.level_count, {1, kMaxPyramidLevels}, "1", "number of levels");
  const auto strides = [&](int l) -> auto& { return shape.levels[l].stride; };
  const auto columns = [&](int l) -> auto& { return shape.levels[l].columns; };
  const auto rows = [&](int l) -> auto& { return shape.levels[l].rows; };
  fields.levelReals("level_strides", shape.level_count, strides, {FLT_MIN, kMaxMapSize}, "texel",
                    "stride of each level, which the size of its footprints follows");
  fields.levelIntegers("level_columns", shape.level_count, columns, kMapSize, "1", "footprints along u of each level");
  fields.levelIntegers("level_rows", shape.level_count, rows, kMapSize, "1", "footprints along v of each level");
  describeSlopes(fields, shape.slopes);
}

/// Whether a matrix is a covariance: no eigenvalue below 0, but for the rounding of floats.
bool isCovariance(const Covariance& c);
void checkSlopes(const MapSlopes& slopes, Findings& findings);
void checkShape(const PyramidShape& shape, Findings& findings);

/// Images of all levels together.
std::size_t imageCount(const PyramidShape& shape);

/// A rule of a kind. A file that breaks it is refused.
inline Rule errorRule(std::string_view id, std::string_view summary, std::string_view remedy = kMakeAgain) {
  return {id, Severity::error, ErrorCode::invalid_input, summary, remedy};
}
/// A rule of a kind. A file that breaks it is read with a warning.
inline Rule warningRule(std::string_view id, std::string_view summary) {
  return {id, Severity::warning, ErrorCode::invalid_input, summary, kMakeAgain};
}

}  // namespace glint::formats
