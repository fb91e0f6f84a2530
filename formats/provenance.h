#pragma once

#include <string>
#include <vector>

namespace glint::formats {

/// One input of a run.
struct InputRecord {
  std::string name;      ///< file name as given; UTF-8, no NUL
  std::string hash_hex;  ///< XXH3 128-bit hash of the file, 32 lower-case hexadecimal digits; see hashFile
  friend bool operator==(const InputRecord&, const InputRecord&) = default;
};

/// How an asset was made: enough to make it again.
struct Provenance {
  std::string generator;     ///< tool and version, e.g. "glint-pyramid 0.1.0"
  std::string command_json;  ///< JSON object of every parameter that changed the result; at most 60000 bytes
  std::vector<InputRecord> inputs;
  friend bool operator==(const Provenance&, const Provenance&) = default;
};

}  // namespace glint::formats
