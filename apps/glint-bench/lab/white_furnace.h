#pragma once

#include <vector>

#include "glint/query/brdf/displaced_brdf.h"

namespace glint::apps {

/// How far a white surface that was downsampled is from sending back all light of an even sky (Wu 2019, Fig. 13): the mean, over
/// views up to 70 degrees, of |reflected / received - 1|.
double meanFurnaceError(const DisplacedBrdf& brdf, DisplacedVariant variant);

/// Makes heights lower towards u = 0, so that relief is deep at one place and flat at another.
/// @param heights  [][width]
void fadeRelief(std::vector<float>& heights, int width);

}  // namespace glint::apps
