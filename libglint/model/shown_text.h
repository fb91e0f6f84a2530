#pragma once

#include <cstddef>
#include <string>
#include <string_view>

namespace glint {

/// Bytes of the UTF-8 character that starts at `at`; 0 if there is none, or one that controls a terminal.
inline std::size_t shownCharacterBytes(std::string_view text, std::size_t at) {
  const auto byte = [&](std::size_t k) { return static_cast<unsigned char>(text[k]); };
  const unsigned char lead = byte(at);
  if (lead < 0x80) return lead >= 0x20 && lead != 0x7f ? 1 : 0;
  if (lead < 0xc2 || lead > 0xf4) return 0;
  const std::size_t size = lead < 0xe0 ? 2 : lead < 0xf0 ? 3 : 4;
  if (text.size() - at < size) return 0;
  unsigned long code = lead & (0xffu >> (size + 1));
  for (std::size_t k = 1; k < size; ++k) {
    if ((byte(at + k) & 0xc0u) != 0x80) return 0;
    code = code << 6 | (byte(at + k) & 0x3fu);
  }
  constexpr unsigned long kSmallest[] = {0, 0, 0xa0, 0x800, 0x10000};  // U+0080 to U+009F are control characters
  return code >= kSmallest[size] && code <= 0x10ffff && !(code >= 0xd800 && code < 0xe000) ? size : 0;
}

/// The text in one line of UTF-8: control characters, and bytes that are no UTF-8, become \n, \t or \x1b.
/// @param most  the text ends as soon as the result has this number of bytes
inline std::string escapedText(std::string_view text, std::size_t most = std::string_view::npos) {
  std::string shown;
  for (std::size_t k = 0; k < text.size() && shown.size() <= most;) {
    const std::size_t size = shownCharacterBytes(text, k);
    if (size > 0) {
      shown += text.substr(k, size);
    } else if (text[k] == '\n' || text[k] == '\t') {
      shown += text[k] == '\n' ? "\\n" : "\\t";
    } else {
      const auto byte = static_cast<unsigned char>(text[k]);
      shown += {'\\', 'x', "0123456789abcdef"[byte >> 4], "0123456789abcdef"[byte & 15]};
    }
    k += size > 0 ? size : 1;
  }
  return shown;
}

/// Position of the character of UTF-8 that holds byte `at`.
inline std::size_t characterStart(std::string_view text, std::size_t at) {
  while (at > 0 && at < text.size() && (static_cast<unsigned char>(text[at]) & 0xc0u) == 0x80) --at;
  return at;
}

/// The text in one line of at most `most` bytes (>= 8): longer text is cut and ends in "...".
inline std::string shownText(std::string_view text, std::size_t most) {
  std::string shown = escapedText(text, most);
  if (shown.size() <= most) return shown;
  shown.resize(characterStart(shown, most - 3));
  return shown + "...";
}

/// A path in one line of at most `most` bytes: a longer path is cut and starts with "...", because its end tells files apart.
inline std::string shownPath(std::string_view path, std::size_t most) {
  const std::string shown = escapedText(path);
  if (shown.size() <= most) return shown;
  std::size_t first = shown.size() - (most - 3);
  while (first < shown.size() && characterStart(shown, first) != first) ++first;
  return "..." + shown.substr(first);
}

}  // namespace glint
