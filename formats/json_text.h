#pragma once

// Private to formats/.

#include <string_view>

namespace glint::formats {

/// Whether a text is one JSON object, nested at most kMostJsonDepth deep.
bool isJsonObject(std::string_view text);

}  // namespace glint::formats
