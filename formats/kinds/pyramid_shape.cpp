#include "glint/formats/kinds/pyramid_shape.h"

#include <cmath>

namespace glint::formats {

void packSlopes(const MapSlopes& slopes, PackedAsset& packed) {
  packed.reals("slope_mean", {slopes.mean.x, slopes.mean.y});
  packed.reals("slope_covariance", {slopes.covariance.xx, slopes.covariance.xy, slopes.covariance.yy});
}

MapSlopes unpackSlopes(const Content& content) {
  return {{content.real("slope_mean", 0), content.real("slope_mean", 1)},
          {content.real("slope_covariance", 0), content.real("slope_covariance", 1), content.real("slope_covariance", 2)}};
}

void checkSlopes(const MapSlopes& slopes, Findings& findings) {
  constexpr double kRounding = 1e-6;  // of three floats
  const Covariance& c = slopes.covariance;
  const double square = double{c.xy} * c.xy;
  if (c.xx >= 0 && c.yy >= 0 && square <= (1 + kRounding) * c.xx * c.yy) return;
  findings.add("shape.slopes", "/@slope_covariance",
               "is not a covariance: a variance is negative, or the covariance too large");
}

void packShape(const PyramidShape& shape, PackedAsset& packed) {
  if (shape.level_count < 1 || shape.level_count > kMaxPyramidLevels) {
    throw Error(ErrorCode::usage, "attribute.value", {}, "/@level_count",
                "is " + std::to_string(shape.level_count) + ", not 1 to " + std::to_string(kMaxPyramidLevels));
  }
  packed.integer("width", shape.width);
  packed.integer("height", shape.height);
  packed.integer("resolution", shape.resolution);
  packed.real("sigma_r", shape.sigma_r);
  packed.text("surface", shape.surface == Surface::flat ? "flat" : "smooth");
  packed.text("boundary", shape.boundary == Boundary::wrap ? "wrap" : "clamp");
  packed.integer("level_count", shape.level_count);
  std::vector<double> strides;
  std::vector<double> columns;
  std::vector<double> rows;
  for (int l = 0; l < shape.level_count; ++l) {
    strides.push_back(shape.levels[l].stride);
    columns.push_back(shape.levels[l].columns);
    rows.push_back(shape.levels[l].rows);
  }
  packed.reals("level_strides", std::move(strides));
  packed.integers("level_columns", std::move(columns));
  packed.integers("level_rows", std::move(rows));
  packSlopes(shape.slopes, packed);
}

void unpackShape(const Content& content, PyramidShape& shape) {
  shape.width = content.integer("width");
  shape.height = content.integer("height");
  shape.resolution = content.integer("resolution");
  shape.sigma_r = content.real("sigma_r");
  shape.surface = content.is("surface", "flat") ? Surface::flat : Surface::smooth;
  shape.boundary = content.is("boundary", "wrap") ? Boundary::wrap : Boundary::clamp;
  shape.level_count = content.integer("level_count");
  for (int l = 0; l < shape.level_count; ++l) {
    shape.levels[l] = {content.real("level_strides", l), content.integer("level_columns", l), content.integer("level_rows", l)};
  }
  shape.slopes = unpackSlopes(content);
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
    const double columns = std::ceil(static_cast<double>(shape.width) / grid.stride);
    const double rows = std::ceil(static_cast<double>(shape.height) / grid.stride);
    const bool is_mean = l == shape.footprintLevels();
    if (!is_mean && (grid.columns != columns || grid.rows != rows)) {
      findings.add("shape.grid", "/@level_columns",
                   "level " + std::to_string(l) + " has " + std::to_string(grid.columns) + " x " + std::to_string(grid.rows) +
                       " footprints, not ceil(size / stride)" + (l + 1 == shape.level_count ? ", nor 1 x 1" : ""));
    }
  }
}

std::size_t imageCount(const PyramidShape& shape) {
  std::size_t count = 0;
  for (int l = 0; l < shape.level_count; ++l) count += shape.levels[l].imageCount();
  return count;
}

}  // namespace glint::formats
