#include "glint/formats/plain_text.h"

#include "glint/model/shown_text.h"

namespace glint::formats {

bool isPlainText(std::string_view text) {
  for (std::size_t k = 0; k < text.size();) {
    const bool blank = text[k] == '\n' || text[k] == '\t' || text[k] == '\r';
    const std::size_t size = blank ? 1 : shownCharacterBytes(text, k);
    if (size == 0) return false;
    k += size;
  }
  return true;
}

}  // namespace glint::formats
