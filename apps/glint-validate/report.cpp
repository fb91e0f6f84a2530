#include "glint-validate/report.h"

#include <algorithm>
#include <nlohmann/json.hpp>

#include "glint/model/shown_text.h"

namespace glint::apps {

using formats::Finding;
using formats::Severity;
using formats::ValidationReport;

std::string reportText(const ValidationReport& report) {
  std::string text;
  for (const Finding& finding : report.findings) {
    text += escapedText(report.path) + ": " + std::string(name(finding.severity)) + ": [" + finding.rule + "] ";
    if (!finding.object.empty()) text += finding.object + ": ";
    text += finding.message + "; " + finding.remedy + "\n";
  }
  return text;
}

nlohmann::json reportJson(std::span<const ValidationReport> reports) {
  nlohmann::json files = nlohmann::json::array();
  for (const ValidationReport& report : reports) {
    nlohmann::json findings = nlohmann::json::array();
    for (const Finding& finding : report.findings) {
      findings.push_back({{"rule", finding.rule},
                          {"severity", name(finding.severity)},
                          {"object", finding.object},
                          {"message", finding.message},
                          {"remedy", finding.remedy}});
    }
    files.push_back({{"path", report.path},
                     {"kind", report.kind},
                     {"valid", report.valid()},
                     {"errors", report.count(Severity::error)},
                     {"warnings", report.count(Severity::warning)},
                     {"findings", std::move(findings)}});
  }
  return {{"schema_version", kReportSchemaVersion}, {"files", std::move(files)}};
}

std::optional<ErrorCode> exitCode(std::span<const ValidationReport> reports, bool warnings_as_errors) {
  constexpr ErrorCode kWorstLast[] = {ErrorCode::unsupported, ErrorCode::invalid_input, ErrorCode::io};
  std::optional<ErrorCode> worst;
  const auto rank = [&](ErrorCode code) { return std::find(std::begin(kWorstLast), std::end(kWorstLast), code); };
  const auto take = [&](ErrorCode code) {
    if (!worst || rank(code) > rank(*worst)) worst = code;
  };
  for (const ValidationReport& report : reports) {
    if (!report.valid()) take(report.errorCode());
    if (warnings_as_errors && report.count(Severity::warning) > 0) take(ErrorCode::invalid_input);
  }
  return worst;
}

}  // namespace glint::apps
