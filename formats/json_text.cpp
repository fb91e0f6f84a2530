#include "glint/formats/json_text.h"

#include <nlohmann/json.hpp>

namespace glint::formats {

bool isJsonObject(std::string_view text) {
  const std::size_t first = text.find_first_not_of(" \t\r\n");
  return first != text.npos && text[first] == '{' && nlohmann::json::accept(text);
}

}  // namespace glint::formats
