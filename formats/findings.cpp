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

void Findings::add(std::string_view rule_id, std::string object, std::string message) {
  const Rule& rule = findRule(rule_id);
  const auto same = std::count_if(report_.findings.begin(), report_.findings.end(),
                                  [&](const Finding& finding) { return finding.rule == rule_id; });
  if (same >= kMaxPerRule) return;
  report_.findings.push_back(
      {std::string(rule.id), rule.severity, std::move(object), std::move(message), std::string(rule.remedy)});
}

void Findings::add(const Error& error) {
  std::string message = error.what();
  // what() is "object: message; remedy"; a finding keeps the three apart.
  if (!error.object().empty()) message.erase(0, error.object().size() + 2);
  if (!error.remedy().empty()) message.resize(message.size() - error.remedy().size() - 2);
  add(error.rule().empty() ? "file.readable" : error.rule(), error.object(), std::move(message));
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
