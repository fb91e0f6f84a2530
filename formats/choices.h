#pragma once

// Private to formats/: lists of texts as the schema writes them, "a|b|c".

#include <string_view>

#include "glint/formats/structure.h"

namespace glint::formats {

/// Number of a text in a list, or -1.
int indexOf(std::string_view text, std::string_view choices);
/// Text of a number in a list; empty if there is none.
std::string_view choiceAt(std::string_view choices, int index);

/// Whether the condition of a TypeChoice holds for the attributes of a file.
bool conditionHolds(std::string_view when, const Attributes& attributes);

}  // namespace glint::formats
