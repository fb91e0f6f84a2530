#include <cmath>

#include "glint/formats/kinds/description.h"
#include "glint/formats/kinds/shared_fields.h"
#include "glint/formats/kinds/tally.h"

namespace glint::formats {

template <>
struct KindDescription<HeightMap> {
  static constexpr std::string_view kTitle = "Height field";

  static std::vector<Rule> indexRules() { return {}; }
  static std::vector<Rule> valueRules() {
    return {errorRule("heights.finite", "heights are finite", "make it again with glint-ingest --fix-invalid")};
  }

  static void describe(Fields auto& fields, auto& map) {
    describeMap(fields, map);
    fields.array("heights", map.heights, {"height", "width"}, "texel", "height over the base plane, bottom row first");
  }

  static void checkIndex(const HeightMap&, Findings&) {}

  static void checkValues(const HeightMap& map, Findings& findings) {
    TexelTally infinite(map.width, map.height);
    for (std::size_t k = 0; k < map.heights.size(); ++k)
      if (!std::isfinite(map.heights[k])) infinite.add(k);
    report(infinite, "heights.finite", "/heights", {"texel is", "texels are"}, "not finite", findings);
  }
};

template const Kind& kindOf<HeightMap>();

}  // namespace glint::formats
