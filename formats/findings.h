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

  /// Adds a finding with the rule's severity and remedy, its texts as shownText() shows them. A rule is reported at most
  /// kMaxPerRule times.
  void add(std::string_view rule, const std::string& object, const std::string& message);
  /// Adds an error that was thrown while reading.
  void add(const Error& error);

  bool failed() const { return !report_.valid(); }
  /// Throws the first error, if there is one, as a glint::Error.
  void throwFirstError() const;

  ValidationReport& report() { return report_; }
  const std::string& path() const { return report_.path; }

 private:
  void addFinding(const Rule& rule, const std::string& object, const std::string& message, const std::string& remedy);

  static constexpr int kMaxPerRule = 20;
  static constexpr std::size_t kMostObject = 200, kMostMessage = 400;  // bytes
  ValidationReport report_;
};

/// Throws the Error of a broken rule; for checks after which reading cannot go on.
[[noreturn]] void throwBroken(std::string_view rule, std::string object, std::string message);

}  // namespace glint::formats
