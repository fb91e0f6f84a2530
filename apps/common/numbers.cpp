#include "common/numbers.h"

#include <fmt/format.h>

#include <charconv>
#include <cmath>
#include <cstdint>
#include <limits>
#include <system_error>
#include <type_traits>

namespace glint::apps {
namespace {

/// Reads all of a text that has no sign but '-'.
template <class T>
std::errc readAll(std::string_view digits, T& value) {
  const char* const end = digits.data() + digits.size();
  const auto [stop, error] = std::from_chars(digits.data(), end, value);
  return stop == end ? error : std::errc::invalid_argument;
}

template <class T>
std::string outOfRange(std::string_view text) {
  if constexpr (std::is_integral_v<T>)
    return fmt::format("'{}' is not in the range {} to {}", text, std::numeric_limits<T>::min(), std::numeric_limits<T>::max());
  else
    return fmt::format("'{}' is out of the range of numbers", text);
}

/// Reads as readAll. A float too small for its type becomes the nearest float.
std::errc readNearest(std::string_view digits, float& value) {
  const std::errc error = readAll(digits, value);
  double wide = 0;
  if (error != std::errc::result_out_of_range || readAll(digits, wide) != std::errc() || std::fabs(wide) > 1) return error;
  value = static_cast<float>(wide);
  return std::errc();
}
template <class T>
std::errc readNearest(std::string_view digits, T& value) {
  return readAll(digits, value);
}

}  // namespace

std::string_view trimBlanks(std::string_view text) {
  constexpr std::string_view kBlanks = " \t";
  const std::size_t first = text.find_first_not_of(kBlanks);
  return first == text.npos ? std::string_view() : text.substr(first, text.find_last_not_of(kBlanks) + 1 - first);
}

template <class T>
std::string parseNumber(std::string_view text, T& value) {
  std::string_view digits = trimBlanks(text);
  const bool plus = digits.starts_with('+');
  if (plus) digits.remove_prefix(1);
  double any = 0;
  T read = 0;
  const std::errc whole = plus && digits.starts_with('-') ? std::errc::invalid_argument : readAll(digits, any);
  if (whole == std::errc::invalid_argument) return fmt::format("'{}' is not a number", text);
  if (whole == std::errc() && !std::isfinite(any)) return fmt::format("'{}' is not a finite number", text);
  if (std::is_unsigned_v<T> && digits.starts_with('-')) return outOfRange<T>(text);
  const std::errc error = readNearest(digits, read);
  if (error == std::errc::result_out_of_range) return outOfRange<T>(text);
  if (error != std::errc()) return fmt::format("'{}' is not a whole number", text);
  value = read;
  return {};
}
template std::string parseNumber(std::string_view, int&);
template std::string parseNumber(std::string_view, std::uint64_t&);
template std::string parseNumber(std::string_view, float&);
template std::string parseNumber(std::string_view, double&);

bool parseProduct(std::string_view text, int& first, int& second) {
  const std::size_t cross = text.find('x');
  int a = 0, b = 0;
  if (cross == text.npos || !parseNumber(text.substr(0, cross), a).empty() || !parseNumber(text.substr(cross + 1), b).empty() ||
      a < 0 || b < 0)
    return false;
  first = a;
  second = b;
  return true;
}

}  // namespace glint::apps
