#include "glint/model/ndf_pyramid_shard.h"

#include "glint/formats/kinds/description.h"
#include "glint/formats/kinds/near_fields.h"
#include "glint/formats/kinds/pyramid_fields.h"

namespace glint::formats {

template <>
struct KindDescription<NdfPyramidShard> {
  static constexpr std::string_view kTitle = "Shard of a pyramid of NDF images, to be joined with the others";

  static std::vector<Rule> indexRules() {
    return {errorRule("shard.region", "region_index is at most region_count"),
            errorRule("shard.mean", "the last level is the mean of the map"),
            errorRule("shard.rows", "level_region_rows are the rows whose centres lie in the region"),
            errorRule("shard.near_rows", "near_rows are the rows of texels of the region")};
  }
  static std::vector<Rule> valueRules() { return {}; }

  static void describe(Fields auto& fields, auto& shard) {
    describePyramidAttributes(fields, shard.images);
    fields.integer("region_index", shard.region.index, {1, kMostRegions}, "1",
                   "number of the region, from the bottom of the map");
    fields.integer("region_count", shard.region.count, {1, kMostRegions}, "1", "number of regions of the map");
    fields.choice("level_choice", shard.level_choice, "given|agreeing",
                  "whether all levels stay, or those that agree are dropped when shards are joined");
    const auto rows = [&](int l) -> auto& { return shard.rows[l]; };
    fields.levelIntegers("level_region_rows", shard.images.shape.level_count, rows, {0, kMaxMapSize}, "1",
                         "rows of footprints of each level that are in the region");
    fields.together(kNearNormals, shard.near_normals, [&](auto&& near) {
      fields.choice(kNearNormals, near.type, "f32|i16", "type of the normals that the joined pyramid keeps");
      fields.integer("near_rows", near.rows, {0, kMaxMapSize}, "1", "rows of texels that are in the region");
    });
    describePyramidLevels(fields, shard.images, [](int, std::uint64_t) {},
                          {"level_region_rows[l]", "level_region_rows[l] * level_columns[l] * mask_words + 1"});
    fields.together(kNearNormals, shard.near_normals, [&](auto&& near) {
      fields.array("near/normals", near.normals, {"near_rows", "width", "2"}, "1",
                   "(nx, ny) of the texels of the region on the unit disk, bottom row first");
    });
  }

  static void checkIndex(const NdfPyramidShard& shard, Findings& findings) {
    const PyramidShape& shape = shard.images.shape;
    if (shard.region.index > shard.region.count)
      return findings.add(
          "shard.region", "/@region_index",
          "is " + std::to_string(shard.region.index) + " of " + std::to_string(shard.region.count) + " regions");
    if (shape.levels[shape.level_count - 1].imageCount() != 1)
      return findings.add("shard.mean", "/@level_columns", "has more than one image in the last level, which must be the mean");
    for (int l = 0; l < shape.level_count; ++l) {
      const int expected = regionRows(shape, l, shard.region).count();
      if (shard.rows[l] != expected)
        findings.add("shard.rows", "/@level_region_rows",
                     "has " + std::to_string(shard.rows[l]) + " rows of level " + std::to_string(l) + ", not " +
                         std::to_string(expected));
    }
    if (shard.near_normals) {
      const int expected = regionTexels(shape.height, shard.region).count();
      if (shard.near_normals->rows != expected)
        findings.add("shard.near_rows", "/@near_rows",
                     "is " + std::to_string(shard.near_normals->rows) + ", not " + std::to_string(expected));
    }
    checkPyramidIndex(shard.images, findings);
  }

  static void checkValues(const NdfPyramidShard& shard, Findings& findings) {
    NdfPyramid held = shard.images;  // whose levels are as large as their arrays
    for (int l = 0; l < held.shape.level_count; ++l) held.shape.levels[l].rows = shard.rows[l];
    checkPyramidValues(held, findings);
    if (!shard.near_normals) return;
    NearNormals near;
    near.width = shard.images.shape.width;
    near.height = shard.near_normals->rows;
    near.texels = shard.near_normals->normals.data();
    checkNearDisk(near, findings, "not inside the unit disk (rows are those of the region)");
  }
};

template const Kind& kindOf<NdfPyramidShard>();

}  // namespace glint::formats
