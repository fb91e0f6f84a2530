#pragma once

// Private to formats/.

#include <string_view>

namespace glint::formats {

/// Whether a text can be shown: well-formed UTF-8 without control characters (a name could otherwise drive a terminal), and without
/// marks of direction (a text could otherwise be shown in another order).
bool isPlainText(std::string_view text);

}  // namespace glint::formats
