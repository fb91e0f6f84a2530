#pragma once

// Private to formats/.

#include <filesystem>
#include <string>
#include <string_view>

#include "glint/formats/validate.h"

namespace glint::formats {

/// Collects what is wrong with one file.
class Findings {
 public:
  explicit Findings(const std::filesystem::path& path) { report_.path = path.string(); }

  /// Adds a finding with the rule's severity and remedy. A rule is reported at most kMaxPerRule times.
  void add(std::string_view rule, std::string object, std::string message);
  /// Adds an error that was thrown while reading.
  void add(const Error& error);

  bool failed() const { return !report_.valid(); }
  /// Throws the first error, if there is one, as a glint::Error.
  void throwFirstError() const;

  ValidationReport& report() { return report_; }
  const std::string& path() const { return report_.path; }

 private:
  static constexpr int kMaxPerRule = 20;
  ValidationReport report_;
};

/// Throws the Error of a broken rule; for checks after which reading cannot go on.
[[noreturn]] void throwBroken(std::string_view rule, std::string object, std::string message);

}  // namespace glint::formats
