#include "glint/formats/kinds/description.h"
#include "glint/formats/kinds/pyramid_fields.h"
#include "glint/formats/kinds/wang_fields.h"

namespace glint::formats {

template <>
struct KindDescription<WangPyramid> {
  static constexpr std::string_view kTitle = "Pyramid of NDF images of Wang tiles";

  static std::vector<Rule> indexRules() {
    return {errorRule("wang.levels", "each tile has as many rows of images as columns, and the last level is one image")};
  }
  static std::vector<Rule> valueRules() {
    return {errorRule("wang.masses", "masses are 0 to 1, and those of one centre in all tiles sum to 1")};
  }

  static void describe(Fields auto& fields, auto& pyramid) {
    describeTileImages(fields, pyramid.plane, pyramid.images.shape);
    describePixels(fields, pyramid.images);
    describeTileMasses(fields, pyramid.plane, pyramid.images.shape);
    describePyramidLevels(fields, pyramid.images, [](int, std::uint64_t) {});
  }

  static void checkIndex(const WangPyramid& pyramid, Findings& findings) {
    checkTileImages(pyramid.plane, pyramid.images.shape, findings);
    checkPyramidMasks(pyramid.images, findings);
  }

  static void checkValues(const WangPyramid& pyramid, Findings& findings) {
    checkTileMasses(pyramid.plane, pyramid.images.shape, findings);
    checkPyramidValues(pyramid.images, findings);
  }
};

template const Kind& kindOf<WangPyramid>();

}  // namespace glint::formats
