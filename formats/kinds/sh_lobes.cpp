#include <cmath>

#include "glint/formats/kinds/description.h"
#include "glint/formats/kinds/sh_fields.h"

namespace glint::formats {

template <>
struct KindDescription<ShLobes> {
  static constexpr std::string_view kTitle = "Turned roughness lobes in spherical harmonics";

  static std::vector<Rule> indexRules() { return {}; }
  static std::vector<Rule> valueRules() {
    return {warningRule("sh.zonal", "lobes have the norm of the lobe along +z within 1e-2")};
  }

  static void describe(Fields auto& fields, auto& lobes) {
    describeSh(fields, lobes, 0);
    fields.real("sigma_r", lobes.sigma_r, kDiskUnits, "1", "intrinsic roughness: standard deviation in disk units");
    fields.array("zonal", lobes.zonal, {"order + 1"}, "1", "coefficients f_l of the lobe along +z");
    describeCoefficients(fields, "lobes", lobes.coefficients, lobes.grid.directionCount() * shCount(lobes.order),
                         {"grid_rows", "grid_columns", "(order + 1) * (order + 1)"},
                         "coefficients of the lobe towards each direction of the grid");
  }

  static void checkIndex(const ShLobes& lobes, Findings& findings) { checkGrid(lobes.grid, true, findings); }

  static void checkValues(const ShLobes& lobes, Findings& findings) {
    checkShNumbers(lobes.zonal, true, "/zonal", findings);
    const std::size_t count = shCount(lobes.order);
    double norm = 0;
    for (const float f : lobes.zonal) norm += double{f} * f;
    Tally other;
    for (std::size_t d = 0; d < lobes.grid.directionCount(); ++d) {
      double turned = 0;
      for (int l = 0; l <= lobes.order; ++l) turned += std::pow(bandNorm(lobes.coefficients, lobes.precision, d * count, l), 2);
      if (!std::isfinite(turned)) {
        findings.add("sh.finite", "/lobes", "direction " + std::to_string(d) + " has coefficients that are not finite");
        return;
      }
      if (!(std::fabs(std::sqrt(turned) - std::sqrt(norm)) <= kShNormTolerance * std::sqrt(norm))) other.add(d);
    }
    report(other, "sh.zonal", "/lobes", {"lobe has", "lobes have"}, "another norm than the one along +z", findings,
           directionName);
  }
};

template const Kind& kindOf<ShLobes>();

}  // namespace glint::formats
