#pragma once

#include <cstddef>
#include <filesystem>
#include <span>
#include <string>
#include <vector>

#include "glint/formats/rules.h"

namespace glint::formats {

/// One broken rule at one place of a file.
struct Finding {
  std::string rule;  ///< id, see rules()
  Severity severity = Severity::error;
  std::string object;   ///< path in the file, e.g. "/level_00/masks"; "/" is the root
  std::string message;  ///< what is wrong, a clause
  std::string remedy;   ///< what the user can do, a clause
};

/// What a check of one file found.
struct ValidationReport {
  std::string path;
  std::string kind;  ///< empty if the file's kind could not be read
  std::vector<Finding> findings;

  std::size_t count(Severity severity) const;
  /// Whether readers accept the file.
  bool valid() const { return count(Severity::error) == 0; }
  /// Class of the first error; the value is an exit code. Call only if !valid().
  ErrorCode errorCode() const;
};

struct ValidateOptions {
  bool hashes = true;  ///< compare every dataset with its hash; reads the whole file
  bool data = true;    ///< check values (finite, in the disk, integrals); reads the whole file
};

/// Checks a file against every rule of rules(). Contents of the file never make it throw: they become findings.
/// Safe on untrusted input, as long as nobody changes the file meanwhile.
ValidationReport validateAsset(const std::filesystem::path& path, const ValidateOptions& options = {});

/// The same for the bytes of a file in memory, as Asset::openMemory takes them.
ValidationReport validateMemory(std::span<const std::byte> bytes, const std::string& name, const ValidateOptions& options = {});

}  // namespace glint::formats
