#include "glint/formats/json_text.h"

#include <nlohmann/json.hpp>

#include "glint/model/json_depth.h"

namespace glint::formats {

bool isJsonObject(std::string_view text) {
  const std::size_t first = text.find_first_not_of(" \t\r\n");
  return first != text.npos && text[first] == '{' && jsonDepth(text) <= kMostJsonDepth && nlohmann::json::accept(text);
}

}  // namespace glint::formats
