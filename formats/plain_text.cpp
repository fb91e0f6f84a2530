#include "glint/formats/plain_text.h"

#include <algorithm>
#include <iterator>

#include "glint/model/shown_text.h"

namespace glint::formats {

namespace {

/// Whether a character of UTF-8 turns the direction of a text, so that it is shown in another order than it has.
bool turnsDirection(std::string_view character) {
  constexpr std::string_view kMarks[] = {"\u061c", "\u200e", "\u200f", "\u202a", "\u202b", "\u202c",
                                         "\u202d", "\u202e", "\u2066", "\u2067", "\u2068", "\u2069"};
  return std::find(std::begin(kMarks), std::end(kMarks), character) != std::end(kMarks);
}

}  // namespace

bool isPlainText(std::string_view text) {
  for (std::size_t k = 0; k < text.size();) {
    const bool blank = text[k] == '\n' || text[k] == '\t' || text[k] == '\r';
    const std::size_t size = blank ? 1 : shownCharacterBytes(text, k);
    if (size == 0 || turnsDirection(text.substr(k, size))) return false;
    k += size;
  }
  return true;
}

}  // namespace glint::formats
