#pragma once

#include <string>
#include <string_view>
#include <vector>

namespace glint::api {

/// Words as a sentence offers them: "a, b or c".
inline std::string alternatives(const std::vector<std::string_view>& words) {
  std::string text;
  for (std::size_t k = 0; k < words.size(); ++k) {
    if (k > 0) text += k + 1 < words.size() ? ", " : " or ";
    text += words[k];
  }
  return text;
}

}  // namespace glint::api
