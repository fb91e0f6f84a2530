#pragma once

#include <array>
#include <cmath>
#include <cstdio>
#include <string>

namespace glint {

/// "1.5 GB", "12 MB": units are powers of 1024. Rounded up, so that the text as a value of --max-memory is no less than the number.
inline std::string memoryText(double bytes) {
  constexpr double kKilo = 1024;
  constexpr std::array kUnits = {"bytes", "KB", "MB", "GB", "TB"};
  std::size_t unit = 0;
  double value = bytes;
  for (; value >= kKilo && unit + 1 < kUnits.size(); ++unit) value /= kKilo;
  const int digits = unit == 0 || value >= 100 ? 0 : value >= 10 ? 1 : 2;
  const double scale = std::pow(10.0, digits);
  std::array<char, 64> text{};
  std::snprintf(text.data(), text.size(), "%.*f %s", digits, std::ceil(value * scale) / scale, kUnits[unit]);
  return text.data();
}

}  // namespace glint
