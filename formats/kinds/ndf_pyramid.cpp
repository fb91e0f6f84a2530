#include "glint/formats/kinds/description.h"
#include "glint/formats/kinds/near_fields.h"
#include "glint/formats/kinds/pyramid_fields.h"

namespace glint::formats {

template <>
struct KindDescription<NdfPyramid> {
  static constexpr std::string_view kTitle = "Pyramid of NDF images";

  static std::vector<Rule> indexRules() {
    return {errorRule("pyramid.masks", "no occupancy bit lies beyond the image's blocks"),
            errorRule("pyramid.mask_ranks", "mask_ranks is the running count of occupancy bits")};
  }
  static std::vector<Rule> valueRules() {
    return {errorRule("pyramid.pixels", "pixels are finite and not negative"),
            errorRule("pyramid.block_means", "block_means are the means of the pixels"),
            warningRule("pyramid.integral", "every image integrates to 1 within 1e-3; of a wave-pyramid to at most that")};
  }

  static void describe(Fields auto& fields, auto& pyramid) {
    describePyramidAttributes(fields, pyramid);
    describeNearNormals(fields, pyramid);
    describePyramidLevels(fields, pyramid, [](int, std::uint64_t) {});
    describeNearArrays(fields, pyramid);
  }

  static void checkIndex(const NdfPyramid& pyramid, Findings& findings) {
    checkPyramidIndex(pyramid, findings);
    checkNearIndex(pyramid.near_normals, findings);
  }

  static void checkValues(const NdfPyramid& pyramid, Findings& findings) {
    checkPyramidValues(pyramid, findings);
    checkNearValues(pyramid.near_normals, findings);
  }
};

template const Kind& kindOf<NdfPyramid>();

}  // namespace glint::formats
