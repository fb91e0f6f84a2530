#pragma once

#include <string>
#include <vector>

#include "common/files.h"
#include "common/tool.h"
#include "glint/formats/validate.h"

namespace glint::apps {

/// The command line of glint-validate.
class ValidateOptions {
 public:
  explicit ValidateOptions(Tool& tool);

  /// Files to check: those that were given, or all of the manifest; of both only the ones that are not as a run has recorded them.
  /// @throws Error io, invalid_input
  std::vector<std::string> files() const;

  formats::ValidateOptions values() const { return {.hashes = !quick_, .data = !quick_}; }
  bool warningsAsErrors() const { return warnings_as_errors_; }

  /// Writes the reports that are asked for.
  /// @throws Error io
  void write(std::span<const formats::ValidationReport> reports) const;

 private:
  void check();

  Tool& tool_;
  InputFiles files_;
  std::string since_, junit_, sarif_;
  bool warnings_as_errors_ = false, quick_ = false;
};

}  // namespace glint::apps
