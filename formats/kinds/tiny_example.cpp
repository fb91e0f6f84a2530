#include <cmath>

#include "glint/formats/kinds/description.h"
#include "glint/formats/kinds/pyramid_fields.h"
#include "glint/formats/kinds/tally.h"
#include "glint/formats/number_text.h"
#include "glint/math/bits.h"

namespace glint::formats {
namespace {

constexpr double kMostScale = 64;  // of a transform
constexpr Range kFactor = {1 / kMostScale, kMostScale};
constexpr Range kAngle = {-1e3, 1e3};

/// Levels of tiles of an example of 2^k texels: k; -1 for other sizes.
int tileLevels(int size) {
  if (size < TinyExample::kLeastSize || size > TinyExample::kMostSize || (size & (size - 1)) != 0) return -1;
  return lowestBit(static_cast<std::uint64_t>(size));
}

}  // namespace

template <>
struct KindDescription<TinyExample> {
  static constexpr std::string_view kTitle = "Tiny example";

  static std::vector<Rule> indexRules() {
    return {errorRule("tiny.size", "the example has n x n texels, n a power of two from 2 to 256"),
            errorRule("tiny.levels", "levels are those of the example's tiles, and the mean of a scattered plane"),
            errorRule("tiny.matrix", "the matrix of a tiled plane is not singular"),
            errorRule("tiny.transforms", "ranges of transforms have their smaller number first"),
            errorRule("tiny.reach", "examples reach at most 2 cells, and so few lie over a point that they can be searched")};
  }
  static std::vector<Rule> valueRules() { return {errorRule("tiny.normals", "normals lie inside the unit disk")}; }

  static void describe(Fields auto& fields, auto& tiny) {
    describeLevels(fields, tiny.images.shape);
    fields.choice("mode", tiny.mode, "tiled|scattered", "how copies of the example cover the plane");
    fields.choice("owner", tiny.overlap, "quarters|nearest", "which of several scattered examples is seen");
    fields.reals("matrix", "4", {&tiny.matrix[0], &tiny.matrix[1], &tiny.matrix[2], &tiny.matrix[3]}, {-kMostScale, kMostScale},
                 "1", "tiled: xx, xy, yx, yy of the matrix from the example to the plane");
    fields.reals("offset", "2", {&tiny.offset.x, &tiny.offset.y}, {-kMaxMapSize, kMaxMapSize}, "texel",
                 "tiled: point of the plane where the example's lower left corner is");
    describeTransforms(fields, tiny.transforms);
    fields.real("density", tiny.density, {double{TinyExample::kLeastDensity}, double{TinyExample::kMostDensity}}, "1",
                "scattered: examples in a cell on average");
    fields.real("background_sigma_r", tiny.background_sigma_r, kDiskUnits, "1", "scattered: roughness between examples");
    fields.integer("seed", tiny.seed, {0, 2147483647}, "1", "scattered: seed of the noise that places examples");
    describePixels(fields, tiny.images);
    describePyramidLevels(fields, tiny.images, [](int, std::uint64_t) {});
    fields.array("normals", tiny.normals, {"texels", "2"}, "1",
                 "normals of the example, row by row from the lowest; tiled: turned into the plane");
  }

  static void checkIndex(const TinyExample& tiny, Findings& findings) {
    const PyramidShape& shape = tiny.images.shape;
    const int levels = tileLevels(shape.width);
    if (shape.width != shape.height || levels < 0) {
      findings.add("tiny.size", "/@width",
                   "has " + std::to_string(shape.width) + " x " + std::to_string(shape.height) +
                       " texels, not n x n with n a power of two from 2 to 256");
      return;
    }
    if (tiny.normals.size() != static_cast<std::size_t>(shape.width) * static_cast<std::size_t>(shape.width))
      findings.add("tiny.size", "/normals", "has " + std::to_string(tiny.normals.size()) + " normals, not one for each texel");
    checkPyramidIndex(tiny.images, findings);
    checkLevels(tiny, levels + (tiny.mode == TinyMode::scattered ? 1 : 0), findings);
    const double xx = tiny.matrix[0], xy = tiny.matrix[1], yx = tiny.matrix[2], yy = tiny.matrix[3];
    constexpr double kRounding = 0.999;
    if (!(std::abs(xx * yy - xy * yx) >= kRounding * double{TinyExample::kLeastDeterminant}))
      findings.add("tiny.matrix", "/@matrix", "is singular");
    checkTransforms(tiny, findings);
  }

  static void checkValues(const TinyExample& tiny, Findings& findings) {
    checkPyramidValues(tiny.images, findings);
    reportUnless(
        tiny.normals.size(), [&](std::size_t k) { return dot(tiny.normals[k], tiny.normals[k]) <= 1; }, "tiny.normals",
        "/normals", {"normal is", "normals are"}, "outside the unit disk or not finite", findings);
  }

 private:
  /// The shape of images. It has no border and no overlap.
  static void describeLevels(Fields auto& fields, auto& shape) {
    describeMapSize(fields, shape);
    fields.integer("resolution", shape.resolution, {kBlockSize, 1024}, "pixel",
                   "pixels of an NDF image along each axis; a multiple of 16");
    fields.real("sigma_r", shape.sigma_r, kDiskUnits, "1", "intrinsic roughness: standard deviation in disk units");
    fields.choice("surface", shape.surface, "flat|smooth", "normals between texel centres");
    fields.integer("level_count", shape.level_count, {1, kMaxPyramidLevels}, "1", "number of levels");
    const auto strides = [&](int l) -> auto& { return shape.levels[l].stride; };
    const auto columns = [&](int l) -> auto& { return shape.levels[l].columns; };
    const auto rows = [&](int l) -> auto& { return shape.levels[l].rows; };
    fields.levelReals("level_strides", shape.level_count, strides, {FLT_MIN, kMaxMapSize}, "texel",
                      "side of a tile of each level");
    fields.levelIntegers("level_columns", shape.level_count, columns, kMapSize, "1", "tiles along x of each level");
    fields.levelIntegers("level_rows", shape.level_count, rows, kMapSize, "1", "tiles along y of each level");
    describeSlopes(fields, shape.slopes);
  }

  static void describeTransforms(Fields auto& fields, auto& t) {
    fields.reals("scale", "2", {&t.scale.low, &t.scale.high}, kFactor, "1", "scattered: smallest and largest scale");
    fields.reals("stretch", "2", {&t.stretch.low, &t.stretch.high}, kFactor, "1",
                 "scattered: smallest and largest stretch along the example's x");
    fields.reals("shear", "2", {&t.shear.low, &t.shear.high}, {-kMostScale, kMostScale}, "1",
                 "scattered: smallest and largest shear of x by y");
    fields.reals("rotation", "2", {&t.rotation_rad.low, &t.rotation_rad.high}, kAngle, "rad",
                 "scattered: smallest and largest angle");
    fields.reals("heights", "2", {&t.heights.low, &t.heights.high}, kFactor, "1",
                 "scattered: smallest and largest factor of heights");
    fields.real("mirror", t.mirror, {0, 1}, "1", "scattered: share of examples that are mirrored");
  }

  static void checkLevels(const TinyExample& tiny, int levels, Findings& findings) {
    const PyramidShape& shape = tiny.images.shape;
    if (shape.level_count != levels) {
      findings.add("tiny.levels", "/@level_count",
                   "is " + std::to_string(shape.level_count) + ", not " + std::to_string(levels));
      return;
    }
    for (int l = 0; l < levels; ++l) {
      const PyramidGrid& grid = shape.levels[l];
      const int side = 2 << l, columns = std::max(1, shape.width / side);
      if (grid.stride == static_cast<float>(side) && grid.columns == columns && grid.rows == columns) continue;
      findings.add("tiny.levels", "/@level_columns",
                   "level " + std::to_string(l) + " is not that of tiles of " + std::to_string(side) + " texels");
      return;
    }
  }

  static void checkTransforms(const TinyExample& tiny, Findings& findings) {
    const TinyTransforms& t = tiny.transforms;
    for (const TinyRange& range : {t.scale, t.stretch, t.shear, t.rotation_rad, t.heights}) {
      if (range.low <= range.high) continue;
      findings.add(
          "tiny.transforms", "/",
          "a range of transforms goes from " + numberText(double{range.low}) + " to " + numberText(double{range.high}));
      return;
    }
    const float reach = t.reach();
    constexpr float kRounding = 1e-3f;
    if (reach <= TinyExample::kMostReach + kRounding &&
        TinyExample::sigmaInCells(tiny.density, reach) >= TinyExample::kLeastSigmaInCells - kRounding)
      return;
    findings.add("tiny.reach", "/@density",
                 "and the transforms lay too many examples over a point: they reach " + numberText(double{reach}) + " cells");
  }
};

template const Kind& kindOf<TinyExample>();

}  // namespace glint::formats
