#pragma once

#include <string>

namespace glint::apps {

/// Part `index` of `count` of a whole, from 1 on.
struct Part {
  int index = 1;
  int count = 1;
};

/// Reads "I/N" with I from 1 to N.
/// @param option  named in the error, e.g. "--shard"
/// @param most    largest N
/// @throws Error usage
Part parsePart(const std::string& text, const char* option, int most);

}  // namespace glint::apps
