#pragma once

#include <vector>

namespace glint::apps {

/// Mean FLIP error of two grey pictures (Andersson et al. 2020, FLIP: a difference evaluator for alternating images): what a person
/// sees who looks at both in turns, 0 to 1. For the usual 67 pixels a degree.
///
/// The pictures of glint-bench are grey, and so is most of FLIP for them: chroma is 0, and these few lines remain. The reference
/// library, flip-evaluator, is a Python package; with it, the program could not tell FLIP by itself. A test holds both together.
/// @param truth, image  [height][width] linear luminance, 0 (black) to 1 (white of the screen)
double greyFlip(const std::vector<float>& truth, const std::vector<float>& image, int width, int height);

}  // namespace glint::apps
