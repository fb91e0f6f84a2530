#pragma once

#include <array>
#include <charconv>
#include <string>

namespace glint::formats {

/// The shortest decimal that reads back as the same number, for messages: 0.001 and not 0.001000, nor 0.000000 for 1e-7.
template <class T>
std::string numberText(T value) {
  std::array<char, 32> text;
  return {text.data(), std::to_chars(text.data(), text.data() + text.size(), value).ptr};
}

}  // namespace glint::formats
