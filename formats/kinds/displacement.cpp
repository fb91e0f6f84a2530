#include <cmath>

#include "glint/formats/kinds/description.h"
#include "glint/formats/kinds/shared_fields.h"
#include "glint/formats/kinds/tally.h"

namespace glint::formats {
namespace {

// Sizes of arrays below.
static_assert(kMostScaleTerms == 8 && kBaseTables == 14 && kBaseTableDifference == 32 && kBaseTableHalf == 48);

void describeBase(Fields auto& fields, auto& base) {
  fields.choice("base", base.kind, "diffuse|ggx|table", "reflectance of a facet of the original surface");
  fields.real("albedo", base.albedo, {0, 1}, "1", "diffuse: albedo; others: 1");
  fields.real("alpha", base.alpha, {0, 1}, "1",
              "ggx: roughness; table: roughness of the lobe that samples are drawn from; diffuse: 0");
  fields.real("eta", base.eta, {FLT_MIN, 100}, "1", "ggx: refractive index of the conductor");
  fields.real("k", base.k, {0, 100}, "1", "ggx: extinction of the conductor; with eta 1 and k 0 it reflects all light");
}

void describeLevelSizes(Fields auto& fields, auto& d) {
  const auto integers = [&](const char* name, auto member, Range range, const char* units, const char* long_name) {
    fields.levelIntegers(
        name, d.level_count, [&](int l) -> auto& { return d.levels[l].*member; }, range, units, long_name);
  };
  const auto reals = [&](const char* name, auto member, Range range, const char* long_name) {
    fields.levelReals(
        name, d.level_count, [&](int l) -> auto& { return d.levels[l].*member; }, range, "1", long_name);
  };
  using Level = DisplacementLevel;
  integers("level_factors", &Level::factor, {2, kMaxMapSize}, "texel", "side of a cell of each level");
  integers("level_columns", &Level::columns, kMapSize, "1", "cells along u of each level");
  integers("level_rows", &Level::rows, kMapSize, "1", "cells along v of each level");
  integers("level_spatial_columns", &Level::spatial_columns, {1, 16}, "1", "patches of the spatial scale along u");
  integers("level_spatial_rows", &Level::spatial_rows, {1, 16}, "1", "patches of the spatial scale along v");
  reals("level_rank1_residuals", &Level::rank1_residual, {0, FLT_MAX}, "norm of R - T S over that of R");
  reals("level_scale_residuals", &Level::scale_residual, {0, FLT_MAX}, "the same of all terms");
  reals("level_rank1_energies", &Level::rank1_energy, {0, 1}, "share of the largest singular value's square of R");
  reals("level_interreflected", &Level::interreflected_share, {0, 1},
        "share of the reflected light that was scattered more than once");
  reals("level_distant", &Level::distant_share, {0, 1}, "share of the reflected light that hopped farther than a cell");
}

void describeLevel(Fields auto& fields, auto& level) {
  fields.array("level_{l}/heights", level.heights, {"level_rows[l]", "level_columns[l]"}, "texel", "height of each vertex");
  fields.array("level_{l}/lobes", level.lobes, {"level_rows[l]", "level_columns[l]", "lobe_count", "4"}, "1",
               "centre (x, y) on the disk, bandwidth and amplitude of each lobe of each cell");
  fields.array("level_{l}/slopes", level.slopes, {"level_rows[l]", "level_columns[l]", "5"}, "1",
               "mean slope along u and v, variances uu, uv, vv of each cell");
  fields.array("level_{l}/fit_errors", level.fit_errors, {"level_rows[l]", "level_columns[l]"}, "1",
               "relative error of each cell's lobes, blurred by 8 degrees");
  fields.array("level_{l}/spatial_scale", level.spatial_scale,
               {"level_spatial_rows[l]", "level_spatial_columns[l]", "channels"}, "1", "T: factors of each patch");
  fields.halves("level_{l}/angular_scale", level.angular_scale, {"angular_pairs", "channels"}, "1",
                "S: factors of each pair of directions i <= o at o (o + 1) / 2 + i");
  fields.array("level_{l}/singular_shares", level.singular_shares, {"8"}, "1",
               "squares of the largest singular values of R, over the sum of all");
}

void describeTerms(Fields auto& fields, auto& level) {
  fields.array("level_{l}/spatial_terms", level.spatial_terms,
               {"more_terms", "level_spatial_rows[l]", "level_spatial_columns[l]", "channels"}, "1",
               "factors of each patch, of the further terms");
  fields.halves("level_{l}/angular_terms", level.angular_terms, {"more_terms", "angular_pairs", "channels"}, "1",
                "factors of each pair of directions, of the further terms");
}

bool isProper(const VmfLobe& lobe) {
  return dot(lobe.mu, lobe.mu) <= 1 && lobe.kappa >= 0 && lobe.kappa <= kMaxKappa && lobe.amplitude >= 0 &&
         std::isfinite(lobe.amplitude);
}

bool isFinite(const MapSlopes& m) {
  return std::isfinite(m.mean.x + m.mean.y + m.covariance.xx + m.covariance.xy + m.covariance.yy);
}

void checkLevel(const DisplacementLevel& level, int l, Findings& findings) {
  const auto check = [&](std::string_view rule, const char* dataset, const auto& values, const Subject& subject,
                         const char* what, auto holds) {
    reportUnless(
        values.size(), [&](std::size_t k) { return holds(values[k]); }, rule, "/" + levelPath("level_{l}/", l) + dataset,
        subject, what, findings);
  };
  const auto finite = [](float x) { return std::isfinite(x); };
  const Subject factors = {"factor is", "factors are"};
  check("displacement.heights", "heights", level.heights, {"height is", "heights are"}, "not finite", finite);
  check("displacement.lobes", "lobes", level.lobes, {"lobe is", "lobes are"}, "out of range", isProper);
  check("displacement.bases", "lobe_colors", level.lobe_colors, {"colour is", "colours are"}, "out of range",
        [](float x) { return x >= 0 && x <= 1; });
  check("displacement.bases", "lobe_alphas", level.lobe_alphas, {"alpha is", "alphas are"}, "out of range",
        [](float x) { return x > 0 && x <= 1; });
  check("displacement.moments", "slopes", level.slopes, {"cell has", "cells have"}, "moments that are not finite", isFinite);
  check("displacement.moments", "fit_errors", level.fit_errors, {"error is", "errors are"}, "not finite", finite);
  check("displacement.scales", "spatial_scale", level.spatial_scale, factors, "negative or not finite",
        [](float x) { return std::isfinite(x) && x >= 0; });
  check("displacement.terms", "spatial_terms", level.spatial_terms, factors, "not finite", finite);
  check("displacement.terms", "angular_terms", level.angular_terms, factors, "not finite",
        [](std::uint16_t half) { return (half & 0x7c00) != 0x7c00; });
  check("displacement.singular_values", "singular_shares", level.singular_shares, {"share is", "shares are"}, "outside 0 to 1",
        [](float x) { return x >= 0 && x <= 1; });
  check("displacement.scales", "angular_scale", level.angular_scale, factors, "negative or not finite",
        [](std::uint16_t half) { return (half & 0x7c00) != 0x7c00 && (half & 0x8000) == 0; });
}

}  // namespace

template <>
struct KindDescription<Displacement> {
  static constexpr std::string_view kTitle = "Downsampled displacement map that keeps its appearance";

  static std::vector<Rule> indexRules() {
    return {
        errorRule("displacement.levels", "factors ascend, are at most the map's sides, and give the level's numbers of cells"),
        errorRule("displacement.base", "a base that is a table has its numbers, and other bases have none")};
  }
  static std::vector<Rule> valueRules() {
    return {errorRule("displacement.heights", "downsampled heights are finite"),
            errorRule("displacement.lobes", "lobes have centres in the disk, bandwidths up to 1e6 and amplitudes of 0 or more"),
            errorRule("displacement.bases", "colours of lobes are 0 to 1, and their alphas above 0 and at most 1"),
            errorRule("displacement.base_table", "values of the base's tables are finite and not negative"),
            errorRule("displacement.scales", "scaling functions are finite and not negative"),
            errorRule("displacement.terms", "further terms of the scaling functions are finite"),
            errorRule("displacement.singular_values", "shares of singular values are 0 to 1"),
            errorRule("displacement.moments", "slope moments and fit errors are finite")};
  }

  static void describe(Fields auto& fields, auto& d) {
    describeMap(fields, d);
    describeBase(fields, d.base);
    int rgb = d.channels == 3, has_colors = !d.levels[0].lobe_colors.empty(), has_alphas = !d.levels[0].lobe_alphas.empty();
    fields.integer("rgb", rgb, {0, 1}, "1", "1 if colours, T and S are linear red, green and blue, not grey");
    fields.set(d.channels, 2 * rgb + 1);
    fields.integer("lobe_count", d.lobe_count, {1, kMaxLobes}, "1", "lobes of a cell");
    fields.integer("has_lobe_colors", has_colors, {0, 1}, "1", "1 if lobes have colours of their own");
    fields.integer("has_lobe_alphas", has_alphas, {0, 1}, "1", "1 if lobes have a roughness of their own");
    fields.integer("angular", d.angular, {3, kMostAngular}, "1",
                   "cells of the concentric map along each axis, for either direction");
    fields.integer("more_terms", d.more_terms, {0, kMostScaleTerms - 1}, "1", "terms of the scaling function beyond T S");
    fields.integer("level_count", d.level_count, {1, kMaxDisplacementLevels}, "1", "levels of detail");
    describeLevelSizes(fields, d);
    fields.derived("angular_pairs", "ceil_div(angular * angular * (angular * angular + 1), 2)", "pairs of directions");
    fields.derived("channels", "2 * rgb + 1", "numbers of a colour, of T and of S");
    fields.together("diffuse_share", d.table, [&](auto&& table) {
      fields.real("diffuse_share", table.diffuse_share, {0, 1}, "1",
                  "table: share of the samples that are drawn by the cosine");
      fields.array("base_table", table.values, {"14", "32", "48", "48", "channels"}, "1/sr",
                   "the base at each difference angle and place of the normal: averaged over lobes, and itself");
    });
    fields.levels("level_count", d.level_count, [&](int l) { describeLevel(fields, d.levels[l]); });
    fields.levels("level_count * ceil_div(more_terms, 7)", d.more_terms > 0 ? d.level_count : 0,
                  [&](int l) { describeTerms(fields, d.levels[l]); });
    fields.levels("level_count * has_lobe_colors", d.level_count * has_colors, [&](int l) {
      fields.array("level_{l}/lobe_colors", d.levels[l].lobe_colors,
                   {"level_rows[l]", "level_columns[l]", "lobe_count", "channels"}, "1",
                   "factors of the base's reflectance of each lobe");
    });
    fields.levels("level_count * has_lobe_alphas", d.level_count * has_alphas, [&](int l) {
      fields.array("level_{l}/lobe_alphas", d.levels[l].lobe_alphas, {"level_rows[l]", "level_columns[l]", "lobe_count"}, "1",
                   "ggx: roughness of the base of each lobe");
    });
  }

  static void checkIndex(const Displacement& displacement, Findings& findings) {
    if (displacement.table.has_value() != (displacement.base.kind == BaseBrdf::Kind::table))
      findings.add(
          "displacement.base", "/@base",
          displacement.table ? "the base is no table, and the file has one" : "the base is a table, and the file has none");
    for (int l = 0; l < displacement.level_count; ++l) {
      const DisplacementLevel& level = displacement.levels[l];
      const auto covers = [&](int cells, int texels) {
        return level.factor <= texels && cells == displacementCells(texels, level.factor);
      };
      if (covers(level.columns, displacement.width) && covers(level.rows, displacement.height) &&
          (l == 0 || level.factor > displacement.levels[l - 1].factor))
        continue;
      findings.add("displacement.levels", "/@level_factors",
                   "level " + std::to_string(l) + " has " + std::to_string(level.columns) + " x " + std::to_string(level.rows) +
                       " cells of " + std::to_string(level.factor) + " texels on a map of " +
                       std::to_string(displacement.width) + " x " + std::to_string(displacement.height));
    }
  }

  static void checkValues(const Displacement& displacement, Findings& findings) {
    if (displacement.table)
      reportUnless(
          displacement.table->values.size(),
          [&](std::size_t k) { return displacement.table->values[k] >= 0 && std::isfinite(displacement.table->values[k]); },
          "displacement.base_table", "/base_table", {"value is", "values are"}, "negative or not finite", findings);
    for (int l = 0; l < displacement.level_count; ++l) checkLevel(displacement.levels[l], l, findings);
  }
};

template const Kind& kindOf<Displacement>();

}  // namespace glint::formats
