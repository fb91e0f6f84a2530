#pragma once

// Private to formats/: the part that every pyramid of NDF images shares.

#include "glint/formats/kinds/codec.h"

namespace glint::formats {

/// The slopes of the map, for every kind that a BRDF can be made from: attributes `slope_mean` and `slope_covariance`.
void packSlopes(const MapSlopes& slopes, PackedAsset& packed);
MapSlopes unpackSlopes(const Content& content);
void checkSlopes(const MapSlopes& slopes, Findings& findings);

void packShape(const PyramidShape& shape, PackedAsset& packed);
void unpackShape(const Content& content, PyramidShape& shape);
void checkShape(const PyramidShape& shape, Findings& findings);

/// Images of all levels together.
std::size_t imageCount(const PyramidShape& shape);

}  // namespace glint::formats
