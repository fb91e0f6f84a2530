#pragma once

#include <cstdint>
#include <span>
#include <string_view>

#include "glint/math/device.h"  // asks for C++20
#include "glint/model/error.h"

namespace glint::formats {

/// How bad a finding is: readers refuse a file with an error and read one with warnings.
enum class Severity : std::uint8_t { error, warning, info };

/// "error", "warning" or "info".
std::string_view name(Severity severity);

/// One rule that a valid file keeps. Ids are stable: they are never reused or renamed.
struct Rule {
  std::string_view id;
  Severity severity = Severity::error;
  ErrorCode code = ErrorCode::invalid_input;  ///< class of the error when the rule is broken
  std::string_view summary;                   ///< what holds in a valid file
  std::string_view remedy;                    ///< what the user can do when it does not
};

/// Remedy for what only the maker of a file can get wrong.
inline constexpr std::string_view kMakeAgain = "make the file again from its inputs";

/// Remedy where a shard is given and a whole asset is meant.
inline constexpr std::string_view kJoinShards = "join it with the other shards by glint-merge";

/// All rules, in the order in which they are checked.
std::span<const Rule> rules();
/// The rule with this id. The id must exist.
const Rule& findRule(std::string_view id);

}  // namespace glint::formats
