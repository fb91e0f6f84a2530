#pragma once

#include <cstddef>
#include <string>
#include <string_view>

namespace glint::apps {

/// Bytes as text of RFC 4648, with padding.
std::string base64(std::string_view bytes);

/// Whether a text is base64, with padding, of this number of bytes.
bool isBase64(std::string_view text, std::size_t bytes);

}  // namespace glint::apps
