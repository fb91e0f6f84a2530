#pragma once

// Private to formats/.

#include <string>
#include <string_view>

#include "glint/formats/findings.h"
#include "glint/model/texel_name.h"

namespace glint::formats {

/// Reports texels that break a rule, if there are any: how many, and the first.
inline void report(const TexelTally& tally, std::string_view rule, const std::string& object, const std::string& what,
                   Findings& findings) {
  if (tally.count() == 0) return;
  findings.add(rule, object, std::to_string(tally.count()) + " " + what + " (first at " + tally.firstName() + ")");
}

}  // namespace glint::formats
