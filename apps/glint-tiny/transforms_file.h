#pragma once

#include <string>

#include "glint/bake/tiny/tiny_example.h"

namespace glint::apps {

/// Reads the transforms of examples from a JSON file (--transforms; its form is in the help text of glint-tiny) into options.
///
/// Tiled: one transform, of numbers. Scattered: a number, or a range [low, high] from which each example draws its own.
/// @throws Error io; invalid_input for what is no JSON of this form; a range of numbers whose ends are swapped; factors not above 0
void readTransforms(const std::string& path, bake::TinyOptions& options);

}  // namespace glint::apps
