#pragma once

#include "glint/model/ndf_pyramid.h"

namespace glint::bake {

/// How much level `level + 1` of a pyramid differs from the level below it: rel_l2 between every image and the up to four
/// images of `level` nearest to it, over the whole level. Where it is small, `level` answers larger footprints as well.
/// @param level  0 to level_count - 2
double levelDisagreement(const NdfPyramid& pyramid, int level);

}  // namespace glint::bake
