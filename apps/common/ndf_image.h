#pragma once

#include <vector>

#include "glint/api/any_ndf.h"
#include "glint/bake/common/progress.h"

namespace glint::apps {

/// Pixel means of the density over [-1, 1]^2, [resolution][resolution], bottom row first.
std::vector<float> ndfImage(const api::AnyNdf& any, const Footprint& footprint, int resolution,
                            const bake::ProgressFn& progress = {});

}  // namespace glint::apps
