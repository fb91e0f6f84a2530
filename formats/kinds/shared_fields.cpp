#include "glint/formats/kinds/shared_fields.h"

#include <cmath>

namespace glint::formats {

bool isCovariance(const Covariance& c) {
  constexpr double kRounding = 1e-6;  // of three floats
  return c.xx >= 0 && c.yy >= 0 && double{c.xy} * c.xy <= (1 + kRounding) * c.xx * c.yy;
}

void checkSlopes(const MapSlopes& slopes, Findings& findings) {
  if (isCovariance(slopes.covariance)) return;
  findings.add("shape.slopes", "/@slope_covariance",
               "is not a covariance: a variance is negative, or the covariance too large");
}

void checkShape(const PyramidShape& shape, Findings& findings) {
  if (shape.resolution % kBlockSize != 0) {
    findings.add("shape.resolution", "/@resolution", "is " + std::to_string(shape.resolution) + ", not a multiple of 16");
  }
  checkSlopes(shape.slopes, findings);
  for (int l = 0; l < shape.level_count; ++l) {
    const PyramidGrid& grid = shape.levels[l];
    if (l > 0 && grid.stride != 2 * shape.levels[l - 1].stride) {
      findings.add("shape.strides", "/@level_strides", "level " + std::to_string(l) + " is not twice the level before");
    }
    const PyramidGrid expected = shape.gridOf(grid.stride);
    const bool is_mean = l == shape.footprintLevels();
    if (!is_mean && (grid.columns != expected.columns || grid.rows != expected.rows)) {
      findings.add("shape.grid", "/@level_columns",
                   "level " + std::to_string(l) + " has " + std::to_string(grid.columns) + " x " + std::to_string(grid.rows) +
                       " footprints, not " + std::to_string(expected.columns) + " x " + std::to_string(expected.rows) +
                       (l + 1 == shape.level_count ? ", nor 1 x 1" : ""));
    }
  }
}

std::size_t imageCount(const PyramidShape& shape) {
  std::size_t count = 0;
  for (int l = 0; l < shape.level_count; ++l) count += shape.levels[l].imageCount();
  return count;
}

}  // namespace glint::formats
