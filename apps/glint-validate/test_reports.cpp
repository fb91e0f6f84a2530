#include "glint-validate/test_reports.h"

#include <fmt/format.h>

#include <algorithm>
#include <map>
#include <nlohmann/json.hpp>
#include <set>

#include "glint/formats/rules.h"
#include "glint/model/shown_text.h"

namespace glint::apps {
namespace {

using formats::Finding;
using formats::Severity;
using formats::ValidationReport;
using Json = nlohmann::ordered_json;

/// A text as XML has it, in an attribute or an element. The four elements below need no library of XML: escapedText leaves UTF-8 without
/// control characters, so that these five are all that has a meaning.
std::string xmlText(const std::string& text) {
  // The two characters of Unicode that XML refuses, and that escapedText leaves.
  constexpr std::pair<std::string_view, std::string_view> kRefused[] = {{"\xef\xbf\xbe", "\\ufffe"},
                                                                        {"\xef\xbf\xbf", "\\uffff"}};
  static const std::map<char, const char*> kNames = {
      {'&', "&amp;"}, {'<', "&lt;"}, {'>', "&gt;"}, {'"', "&quot;"}, {'\'', "&apos;"}};
  std::string shown = escapedText(text), escaped;
  for (const auto& [character, name] : kRefused)
    for (std::size_t k; (k = shown.find(character)) != std::string::npos;) shown.replace(k, character.size(), name);
  for (const char c : shown) {
    const auto name = kNames.find(c);
    escaped += name == kNames.end() ? std::string(1, c) : name->second;
  }
  return escaped;
}

std::string lineOf(const Finding& finding) {
  const std::string object = finding.object.empty() ? "" : finding.object + ": ";
  return fmt::format("{}: [{}] {}{}; {}", name(finding.severity), finding.rule, object, finding.message, finding.remedy);
}

bool fails(const Finding& finding, bool warnings_as_errors) {
  return finding.severity == Severity::error || (warnings_as_errors && finding.severity == Severity::warning);
}

/// An element with the findings that fail, or the others.
std::string findingsXml(const ValidationReport& report, bool warnings_as_errors, bool failing) {
  std::string lines, first;
  for (const Finding& finding : report.findings) {
    if (fails(finding, warnings_as_errors) != failing) continue;
    lines += xmlText(lineOf(finding)) + "\n";
    if (first.empty()) first = fmt::format("message=\"{}\" type=\"{}\"", xmlText(finding.message), xmlText(finding.rule));
  }
  if (lines.empty()) return "";
  return failing ? fmt::format("   <failure {}>{}</failure>\n", first, lines)
                 : fmt::format("   <system-out>{}</system-out>\n", lines);
}

/// A path as a URI that names it from where the tool runs.
std::string uriOf(const std::string& path) {
  constexpr std::string_view kPlain = "abcdefghijklmnopqrstuvwxyzABCDEFGHIJKLMNOPQRSTUVWXYZ0123456789-._~/";
  std::string uri = path.starts_with('/') ? "file://" : "";
  for (const char c : path)
    uri += kPlain.find(c) != std::string_view::npos ? std::string(1, c) : fmt::format("%{:02X}", static_cast<unsigned char>(c));
  return uri;
}

const char* levelOf(Severity severity) {
  if (severity == Severity::error) return "error";
  return severity == Severity::warning ? "warning" : "note";
}

Json resultOf(const ValidationReport& report, const Finding& finding, std::size_t rule_index) {
  Json location = {{"physicalLocation", {{"artifactLocation", {{"uri", uriOf(report.path)}}}}}};
  if (!finding.object.empty()) location["logicalLocations"] = {{{"fullyQualifiedName", finding.object}}};
  return {{"ruleId", finding.rule},
          {"ruleIndex", rule_index},
          {"level", levelOf(finding.severity)},
          {"message", {{"text", finding.message + "; " + finding.remedy}}},
          {"locations", {std::move(location)}}};
}

Json ruleOf(const std::string& id) {
  const formats::Rule& rule = formats::findRule(id);
  return {{"id", id},
          {"shortDescription", {{"text", rule.summary}}},
          {"help", {{"text", rule.remedy}}},
          {"defaultConfiguration", {{"level", levelOf(rule.severity)}}}};
}

}  // namespace

std::string junitReport(std::span<const ValidationReport> reports, bool warnings_as_errors) {
  std::string cases;
  std::size_t failures = 0;
  for (const ValidationReport& report : reports) {
    const std::string failure = findingsXml(report, warnings_as_errors, true);
    const std::string body = failure + findingsXml(report, warnings_as_errors, false);
    failures += failure.empty() ? 0 : 1;
    const std::string kind = report.kind.empty() ? "unknown" : report.kind;
    cases +=
        fmt::format("  <testcase classname=\"glint-validate.{}\" name=\"{}\" time=\"0\"", xmlText(kind), xmlText(report.path));
    cases += body.empty() ? "/>\n" : fmt::format(">\n{}  </testcase>\n", body);
  }
  const std::string counts = fmt::format("tests=\"{}\" failures=\"{}\" errors=\"0\" time=\"0\"", reports.size(), failures);
  return fmt::format(
      "<?xml version=\"1.0\" encoding=\"UTF-8\"?>\n<testsuites name=\"glint-validate\" {}>\n <testsuite "
      "name=\"glint-validate\" {}>\n{} "
      "</testsuite>\n</testsuites>\n",
      counts, counts, cases);
}

nlohmann::ordered_json sarifReport(std::span<const ValidationReport> reports, const std::string& version) {
  std::set<std::string> broken;
  for (const ValidationReport& report : reports)
    for (const Finding& finding : report.findings) broken.insert(finding.rule);
  Json rules = Json::array(), results = Json::array();
  for (const std::string& id : broken) rules.push_back(ruleOf(id));
  for (const ValidationReport& report : reports) {
    for (const Finding& finding : report.findings) {
      const auto index = std::distance(broken.begin(), broken.find(finding.rule));
      results.push_back(resultOf(report, finding, static_cast<std::size_t>(index)));
    }
  }
  const Json driver = {{"name", "glint-validate"}, {"semanticVersion", version}, {"rules", std::move(rules)}};
  return {{"$schema", "https://json.schemastore.org/sarif-2.1.0.json"},
          {"version", "2.1.0"},
          {"runs", {{{"tool", {{"driver", driver}}}, {"columnKind", "utf16CodeUnits"}, {"results", std::move(results)}}}}};
}

}  // namespace glint::apps
