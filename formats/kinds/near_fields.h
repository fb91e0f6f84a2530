#pragma once

// Private to formats/: the normals that pyramids keep for footprints below level 0.

#include "glint/formats/kinds/shared_fields.h"
#include "glint/model/near_normals.h"

namespace glint::formats {

/// The attribute that tells whether an asset keeps normals.
inline constexpr std::string_view kNearNormals = "near_normals";
/// Largest NearNormals::step: codes of 16 bits cover the disk.
inline constexpr double kMostStep = 0x1p-15;

/// Nodes of level l of the bounds along an axis of so many texels.
constexpr int nodesAlong(int texels, int l) {
  return static_cast<int>((std::int64_t{texels} + (std::int64_t{2} << l) - 1) >> (l + 1));
}

/// Attributes of the kept normals.
void describeNearNormals(Fields auto& fields, auto& asset) {
  fields.together(kNearNormals, asset.near_normals, [&](auto&& near) {
    fields.choice(kNearNormals, near.type, "f32|i16", "type of the normals that the asset keeps for footprints below level 0");
    fields.real("near_step", near.step, {FLT_MIN, 1}, "1", "normal = near_step * stored number; 1 for f32");
    fields.integer("near_bounds_level_count", near.bounds_level_count, {0, NormalMap::kMaxBoundsLevels}, "1",
                   "levels of the min-max pyramid of the kept normals; 0 when there is none");
  });
}

/// Arrays of the kept normals.
void describeNearArrays(Fields auto& fields, auto& asset) {
  using enum ElementType;
  const Types types = {{"near_normals=f32", f32}, {"near_normals=i16", i16}};
  fields.together(kNearNormals, asset.near_normals, [&](auto&& near) {
    fields.set(near.width, asset.shape.width);
    fields.set(near.height, asset.shape.height);
    const std::uint64_t numbers =
        std::uint64_t{2} * static_cast<std::uint64_t>(near.width) * static_cast<std::uint64_t>(near.height);
    fields.data("near/normals", near.texels, std::uint64_t{numbers}, types, {"height", "width", "2"}, "1",
                "(nx, ny) on the unit disk over near_step, bottom row first");
    fields.levels("near_bounds_level_count", near.bounds_level_count, [&](int l) {
      auto& level = near.bounds[l];
      fields.set(level.columns, nodesAlong(near.width, l));
      fields.set(level.rows, nodesAlong(near.height, l));
      fields.data(
          "near/bounds/level_{l}", level.nodes, std::uint64_t{4} * level.size(), types,
          {"ceil_div(height, pow2(l + 1))", "ceil_div(width, pow2(l + 1))", "4"}, "1",
          "low nx, low ny, high nx, high ny over near_step of the texels of each node and one more row and column, wrapped");
    });
  });
}

/// Rules near.step and near.bounds_levels.
void checkNearIndex(const std::optional<NearNormals>& near, Findings& findings);
/// Rule near.disk.
void checkNearDisk(const NearNormals& near, Findings& findings, const std::string& fault = "not inside the unit disk");
/// Rules near.disk and near.bounds.
void checkNearValues(const std::optional<NearNormals>& near, Findings& findings);

/// Reports nodes that do not hold all normals below them.
/// @param rule  its id
/// @param path  of the levels, with {l}
void checkBounds(const NearNormals& normals, std::string_view rule, std::string_view path, Findings& findings);

}  // namespace glint::formats
