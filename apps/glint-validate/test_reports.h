#pragma once

#include <nlohmann/json_fwd.hpp>
#include <span>
#include <string>

#include "glint/formats/validate.h"

namespace glint::apps {

/// Reports as JUnit XML, which CI systems show as tests: a test case for each file, which fails with all errors of the file. Warnings are
/// in the output of the test case.
/// @param warnings_as_errors  warnings fail, too
std::string junitReport(std::span<const formats::ValidationReport> reports, bool warnings_as_errors);

/// Reports as SARIF 2.1.0, which CI systems show beside the files: a result for each finding.
/// @param version  of the tool
nlohmann::ordered_json sarifReport(std::span<const formats::ValidationReport> reports, const std::string& version);

}  // namespace glint::apps
