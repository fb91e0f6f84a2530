#pragma once

#include <string>

#include "glint/model/error.h"

namespace glint::apps {

/// Throws the Error of options that do not make a question.
/// @param what    what is wrong, a clause
/// @param remedy  what the user can do, a clause
[[noreturn]] inline void throwUsage(const std::string& what, const std::string& remedy) {
  throw Error(ErrorCode::usage, "query.arguments", "", "", what, remedy);
}

}  // namespace glint::apps
