#include <cmath>

#include "glint/formats/kinds/description.h"
#include "glint/formats/kinds/shared_fields.h"
#include "glint/formats/kinds/tally.h"

namespace glint::formats {
namespace {

std::string levelObject(int l) { return "/" + levelPath("level_{l}/moments", l); }

}  // namespace

template <>
struct KindDescription<SlopeMoments> {
  static constexpr std::string_view kTitle = "Moments of slopes";

  static std::vector<Rule> indexRules() {
    return {errorRule("moments.levels", "levels have the sizes of a chain that ends with one texel")};
  }
  static std::vector<Rule> valueRules() {
    return {errorRule("moments.finite", "moments are finite: means within 1e6, covariances within 1e12"),
            errorRule("moments.covariance", "covariances are positive semi-definite"),
            errorRule("moments.top", "the last level holds slope_mean and slope_covariance")};
  }

  static void describe(Fields auto& fields, auto& moments) {
    describeMapSize(fields, moments);
    fields.choice("boundary", moments.boundary, "wrap|clamp", "what lies beyond the border of the map");
    fields.integer(
        "finest_level", moments.finest_level, {0, SlopeMoments::kMaxLevels - 1}, "1",
        "level of a full chain that is level 0 here: its texels cover 2^finest_level texels of the map along an axis");
    fields.integer("level_count", moments.level_count, {1, SlopeMoments::kMaxLevels}, "1", "number of levels");
    const auto columns = [&](int l) -> auto& { return moments.levels[l].columns; };
    const auto rows = [&](int l) -> auto& { return moments.levels[l].rows; };
    fields.levelIntegers("level_columns", moments.level_count, columns, kMapSize, "1", "texels along u of each level");
    fields.levelIntegers("level_rows", moments.level_count, rows, kMapSize, "1", "texels along v of each level");
    describeSlopes(fields, moments.slopes);
    fields.levels("level_count", moments.level_count, [&](int l) {
      fields.array("level_{l}/moments", moments.levels[l].texels, {"level_rows[l]", "level_columns[l]", "5"}, "1",
                   "mean slope along u and v, and uu, uv, vv of the covariance of slopes, of each texel, bottom row first");
    });
  }

  static void checkIndex(const SlopeMoments& moments, Findings& findings) {
    checkSlopes(moments.slopes, findings);
    const int length = SlopeMoments::chainLength(moments.width, moments.height);
    if (moments.finest_level + moments.level_count != length) {
      findings.add(
          "moments.levels", "/@level_count",
          "is not that of a chain: levels " + std::to_string(moments.finest_level) + " to " + std::to_string(length - 1));
      return;
    }
    for (int l = 0; l < moments.level_count; ++l) {
      const SlopeMomentsLevel& level = moments.levels[l];
      const int columns = SlopeMoments::chainSize(moments.width, moments.finest_level + l);
      const int rows = SlopeMoments::chainSize(moments.height, moments.finest_level + l);
      if (level.columns == columns && level.rows == rows) continue;
      findings.add("moments.levels", "/@level_columns",
                   "level " + std::to_string(l) + " has " + std::to_string(level.columns) + " x " + std::to_string(level.rows) +
                       " texels, not " + std::to_string(columns) + " x " + std::to_string(rows));
      return;
    }
  }

  static void checkValues(const SlopeMoments& moments, Findings& findings) {
    for (int l = 0; l < moments.level_count; ++l) {
      const SlopeMomentsLevel& level = moments.levels[l];
      TexelTally unusable(level.columns, level.rows);
      TexelTally impossible(level.columns, level.rows);
      for (std::size_t k = 0; k < level.texels.size(); ++k) {
        if (!areUsable(level.texels[k])) {
          unusable.add(k);
        } else if (!isCovariance(level.texels[k].covariance)) {
          impossible.add(k);
        }
      }
      report(unusable, "moments.finite", levelObject(l), {"texel is", "texels are"}, "not within the range of moments",
             findings);
      report(impossible, "moments.covariance", levelObject(l), {"texel has", "texels have"}, "a covariance that is none",
             findings);
    }
    checkTop(moments, findings);
  }

 private:
  static void checkTop(const SlopeMoments& moments, Findings& findings) {
    const MapSlopes &top = moments.levels[moments.level_count - 1].texels[0], &all = moments.slopes;
    const Covariance &a = top.covariance, &b = all.covariance;
    const double size2 = double{b.xx} + b.yy + double{dot(all.mean, all.mean)};
    constexpr double kTolerance = 1e-3, kSmallest = 1e-6;  // relative to the slopes, of sums of floats
    const auto differs = [](double x, double y, double scale) { return !(std::abs(x - y) <= kTolerance * scale + kSmallest); };
    if (differs(top.mean.x, all.mean.x, std::sqrt(size2)) || differs(top.mean.y, all.mean.y, std::sqrt(size2)) ||
        differs(a.xx, b.xx, size2) || differs(a.xy, b.xy, size2) || differs(a.yy, b.yy, size2))
      findings.add("moments.top", levelObject(moments.level_count - 1), "does not hold slope_mean and slope_covariance");
  }
};

template const Kind& kindOf<SlopeMoments>();

}  // namespace glint::formats
