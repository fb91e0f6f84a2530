#pragma once

#include <algorithm>
#include <cstddef>
#include <string>
#include <vector>

#include "glint/model/shown_text.h"

namespace glint::apps {

/// The first names of a file's layers, channels or images, for messages: "R, G, B, ...".
/// @param label  label(k, name): text of name number k, which is cut to 40 bytes
template <class Label>
std::string nameList(const std::vector<std::string>& names, Label label) {
  constexpr std::size_t kMost = 12, kMostName = 40;
  std::string list;
  for (std::size_t k = 0; k < std::min(names.size(), kMost); ++k)
    list += (k > 0 ? ", " : "") + label(k, shownText(names[k], kMostName));
  return list + (names.size() > kMost ? ", ..." : "");
}

}  // namespace glint::apps
