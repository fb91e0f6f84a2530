#pragma once

#include <string>
#include <string_view>

namespace glint::apps {

/// Reads a text as one decimal number. Options, configuration files, lists and tables are all read by this function.
///
/// The whole text must be the number; blanks around it are allowed. It may begin with one sign, + or -. Zeros in front mean
/// nothing: "010" is ten. Floating point may have a point and an exponent. Refused are other bases ("0x10"), numbers that are not
/// finite, and numbers that T cannot hold. A float too small for its type becomes the nearest float.
///
/// T: int, std::uint64_t, float or double.
/// @return the fault, such as "'x' is not a number", and then `value` is as before; empty if there is none
template <class T>
std::string parseNumber(std::string_view text, T& value);

/// Reads two whole numbers of at least 0 that are joined by an x, such as "65x128".
/// @return false if the text is something else, and then the numbers are as before
bool parseProduct(std::string_view text, int& first, int& second);

/// A text without the blanks (spaces and tabs) around it.
std::string_view trimBlanks(std::string_view text);

}  // namespace glint::apps
