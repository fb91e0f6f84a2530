#pragma once

#include <algorithm>
#include <string_view>

namespace glint {

/// JSON of files may be nested this deep. Parsers and their values call themselves for each level: a file of brackets alone could
/// use up the stack.
inline constexpr int kMostJsonDepth = 100;

/// Largest number of brackets and braces that are open at once in a text, which need not be valid JSON. O(length)
constexpr int jsonDepth(std::string_view text) {
  int depth = 0, deepest = 0;
  bool quoted = false;
  for (std::size_t k = 0; k < text.size(); ++k) {
    const char c = text[k];
    if (quoted && c == '\\') ++k;  // the next character is part of the string
    if (c == '"') quoted = !quoted;
    if (quoted) continue;
    if (c == '[' || c == '{') deepest = std::max(deepest, ++depth);
    if (c == ']' || c == '}') --depth;
  }
  return deepest;
}

}  // namespace glint
