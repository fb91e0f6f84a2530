#include "glint/formats/findings.h"

#include <algorithm>

namespace glint::formats {

std::size_t ValidationReport::count(Severity severity) const {
  return static_cast<std::size_t>(
      std::count_if(findings.begin(), findings.end(), [&](const Finding& finding) { return finding.severity == severity; }));
}

ErrorCode ValidationReport::errorCode() const {
  for (const Finding& finding : findings) {
    if (finding.severity == Severity::error) return findRule(finding.rule).code;
  }
  return ErrorCode::failed;
}

void Findings::add(std::string_view rule_id, const std::string& object, const std::string& message) {
  addFinding(findRule(rule_id), object, message, std::string(findRule(rule_id).remedy));
}

void Findings::add(const Error& error) {
  const Rule& rule = findRule(error.rule().empty() ? "file.readable" : error.rule());
  addFinding(rule, error.object(), error.clause(), error.remedy().empty() ? std::string(rule.remedy) : error.remedy());
}

void Findings::addFinding(const Rule& rule, const std::string& object, const std::string& message, const std::string& remedy) {
  const auto same = std::count_if(report_.findings.begin(), report_.findings.end(),
                                  [&](const Finding& finding) { return finding.rule == rule.id; });
  if (same >= kMaxPerRule) return;
  // Names and values of a file can be of any length.
  report_.findings.push_back(
      {std::string(rule.id), rule.severity, shownText(object, kMostObject), shownText(message, kMostMessage), remedy});
}

void Findings::throwFirstError() const {
  for (const Finding& finding : report_.findings) {
    if (finding.severity != Severity::error) continue;
    throw Error(findRule(finding.rule).code, finding.rule, report_.path, finding.object, finding.message, finding.remedy);
  }
}

void throwBroken(std::string_view rule_id, std::string object, std::string message) {
  const Rule& rule = findRule(rule_id);
  throw Error(rule.code, std::string(rule.id), {}, std::move(object), std::move(message), std::string(rule.remedy));
}

}  // namespace glint::formats
