#include <algorithm>
#include <cmath>

#include "glint/formats/kinds/description.h"
#include "glint/formats/kinds/sh_fields.h"

namespace glint::formats {

template <>
struct KindDescription<ShLight> {
  static constexpr std::string_view kTitle = "Light for half vectors in spherical harmonics";

  static std::vector<Rule> indexRules() { return {}; }
  static std::vector<Rule> valueRules() { return {errorRule("sh.band_norms", "band_norms are the norms of the coefficients")}; }

  static void describe(Fields auto& fields, auto& light) {
    describeSh(fields, light, 2);
    fields.array("scales", light.scales, {"grid_rows", "grid_columns"}, "1", "coefficient = scale * stored number");
    fields.array("band_norms", light.band_norms, {"grid_rows", "grid_columns", "order + 1"}, "1",
                 "norm of each band's coefficients, the largest of red, green and blue");
    describeCoefficients(fields, "light", light.coefficients, 3 * light.grid.directionCount() * shCount(light.order),
                         {"grid_rows", "grid_columns", "3", "(order + 1) * (order + 1)"},
                         "coefficients of red, green and blue for each outgoing direction of the grid, divided by its scale");
  }

  static void checkIndex(const ShLight& light, Findings& findings) { checkGrid(light.grid, false, findings); }

  static void checkValues(const ShLight& light, Findings& findings) {
    checkShNumbers(light.scales, false, "/scales", findings);
    checkShNumbers(light.band_norms, false, "/band_norms", findings);
    const std::size_t count = shCount(light.order), bands = static_cast<std::size_t>(light.order) + 1;
    Tally other;
    for (std::size_t d = 0; d < light.grid.directionCount(); ++d) {
      double largest = 0;
      for (std::size_t l = 0; l < bands; ++l) largest = std::max(largest, double{light.band_norms[d * bands + l]});
      bool holds = true;
      for (int l = 0; l <= light.order; ++l) {
        double norm = 0;
        for (std::size_t c = 0; c < 3; ++c) {
          const double channel = bandNorm(light.coefficients, light.precision, (d * 3 + c) * count, l);
          if (!std::isfinite(channel)) {
            findings.add("sh.finite", "/light", "direction " + std::to_string(d) + " has coefficients that are not finite");
            return;
          }
          norm = std::max(norm, channel * light.scales[d]);
        }
        const double stored = light.band_norms[d * bands + static_cast<std::size_t>(l)];
        // Small bands lose digits to the largest coefficient's scale in half precision.
        holds &= std::fabs(norm - stored) <= kShNormTolerance * stored + 1e-5 * largest;
      }
      if (!holds) other.add(d);
    }
    report(other, "sh.band_norms", "/band_norms", {"direction has", "directions have"}, "other norms than the coefficients",
           findings, directionName);
  }
};

template const Kind& kindOf<ShLight>();

}  // namespace glint::formats
