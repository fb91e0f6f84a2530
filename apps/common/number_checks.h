#pragma once

#include <fmt/format.h>

#include <CLI/CLI.hpp>
#include <string>

#include "common/numbers.h"

namespace glint::apps {

/// Reads numbers by parseNumber, and hands them to CLI11 in a form that it reads correctly. CLI11 alone takes "010" for eight,
/// and wraps "-1".
template <class T>
CLI::Validator strictNumber() {
  return {[](std::string& text) {
            T value = 0;
            std::string complaint = parseNumber(text, value);
            if (complaint.empty()) text = fmt::format("{}", value);
            return complaint;
          },
          "", "number"};
}

/// Refuses numbers outside [low, high].
inline CLI::Validator numberRange(double low, double high) {
  const std::string range = fmt::format("{:g} to {:g}", low, high);
  return {[low, high, range](std::string& text) {
            double number = 0;
            if (std::string complaint = parseNumber(text, number); !complaint.empty()) return complaint;
            return number >= low && number <= high ? std::string() : text + " is not in the range " + range;
          },
          range, "range"};
}

}  // namespace glint::apps
