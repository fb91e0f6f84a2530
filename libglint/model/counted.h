#pragma once

#include <cstddef>
#include <string>

namespace glint {

/// Subject of a sentence with its verb, for one thing and for many: {"texel is", "texels are"}.
struct Subject {
  const char* one;
  const char* many;
};

/// "1 texel is" or "3 texels are".
inline std::string counted(std::size_t count, const Subject& subject) {
  return std::to_string(count) + " " + (count == 1 ? subject.one : subject.many);
}

}  // namespace glint
