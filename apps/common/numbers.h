#pragma once

#include <string>
#include <string_view>

namespace glint::apps {

/// Reads a text as one decimal number, the only way in which options, configuration files, lists and tables are read.
///
/// All of the text must be the number, but for blanks around it. It may begin with one sign, + or -. Zeros in front mean
/// nothing: "010" is ten. Floating point may have a point and an exponent. Other bases ("0x10") and numbers that are not finite
/// are refused, and so are those that T cannot hold; a float too small for its type becomes the nearest one.
///
/// T: int, std::uint64_t, float or double.
/// @return what is wrong with the text, such as "'x' is not a number", and then `value` is as before; empty if nothing is
template <class T>
std::string parseNumber(std::string_view text, T& value);

/// Reads two whole numbers of at least 0 that are joined by an x, such as "65x128".
/// @return false if the text is something else, and then the numbers are as before
bool parseProduct(std::string_view text, int& first, int& second);

/// A text without the blanks (spaces and tabs) around it.
std::string_view trimBlanks(std::string_view text);

}  // namespace glint::apps
