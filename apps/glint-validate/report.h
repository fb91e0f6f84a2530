#pragma once

#include <nlohmann/json_fwd.hpp>
#include <optional>
#include <span>
#include <string>

#include "glint/formats/validate.h"

namespace glint::apps {

/// Version of the JSON that reportJson makes: grows when a key changes its meaning or goes away.
inline constexpr int kReportSchemaVersion = 1;

/// One line for each finding: "file: error: [rule] object: message; remedy".
std::string reportText(const formats::ValidationReport& report);

/// {"schema_version", "files": [{"path", "kind", "valid", "errors", "warnings", "findings": [...]}]}.
nlohmann::json reportJson(std::span<const formats::ValidationReport> reports);

/// The code to exit with: of the worst file, unreadable before invalid before unsupported. Nothing if all are valid.
std::optional<ErrorCode> exitCode(std::span<const formats::ValidationReport> reports, bool warnings_as_errors);

}  // namespace glint::apps
