#pragma once

#include <variant>

#include "glint/model/bin_map.h"
#include "glint/model/displacement.h"
#include "glint/model/histogram_sat.h"
#include "glint/model/ndf_cp.h"
#include "glint/model/ndf_pyramid.h"
#include "glint/model/normal_map.h"
#include "glint/model/sh.h"

namespace glint::formats {

/// The struct of any kind of asset: the one list of kinds, in the order of their names. To add a kind, add its struct here and
/// describe the kind in a file of formats/kinds/.
using AnyAsset = std::variant<BinMap, Displacement, HeightMap, HistogramSat, NdfCp, NdfPyramid, NormalMap, ShLight, ShLobes>;

}  // namespace glint::formats
