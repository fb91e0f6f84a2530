#pragma once

#include <nlohmann/json.hpp>

#include "glint/model/error.h"

namespace glint::apps {

/// "usage", "io", ...: a code as --json and logs have it.
const char* codeName(ErrorCode code);

/// {"code", "rule", "path", "object", "message", "remedy"}, as --json and logs have it.
nlohmann::ordered_json errorJson(const Error& error);

}  // namespace glint::apps
