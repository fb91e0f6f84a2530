#pragma once

#include <string>
#include <vector>

#include "glint/math/device.h"  // asks for C++20

namespace glint::formats {

/// One input of a run.
struct InputRecord {
  std::string name;      ///< file name as given; UTF-8, no NUL. "A/B": input B of the input A, see chained()
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

/// A run that had one asset as its input, with the inputs of that asset added, by names like "pyramid.glint/normals.glint": so a
/// compressed pyramid still says which map the pyramid was made from.
Provenance chained(Provenance run, const Provenance& of_input);

/// Whether an input record is one of an input's inputs.
inline bool isChained(const InputRecord& input) { return input.name.find('/') != std::string::npos; }

}  // namespace glint::formats
