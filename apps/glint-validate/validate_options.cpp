#include "glint-validate/validate_options.h"

#include <algorithm>
#include <filesystem>
#include <nlohmann/json.hpp>
#include <set>

#include "glint-validate/test_reports.h"
#include "manifest/entry_records.h"

namespace glint::apps {
namespace {

namespace fs = std::filesystem;

/// A file as the folder of a manifest sees it.
std::string seenBy(const Manifest& manifest, const std::string& file) {
  const fs::path folder = fs::weakly_canonical(fs::absolute(manifest.folder));
  const fs::path path = fs::absolute(file);
  return (fs::weakly_canonical(path.parent_path()) / path.filename()).lexically_relative(folder).string();
}

/// All assets of a manifest that are there. A missing one is no business of a check of files: glint-farm status tells of it.
std::vector<std::string> assetsOf(const Manifest& manifest) {
  std::vector<std::string> files;
  for (const ManifestEntry& entry : manifest.entries) {
    std::vector<std::string> names = {entry.output};
    names.insert(names.end(), entry.links.begin(), entry.links.end());
    for (const std::string& name : names)
      if (stampOf(manifest.at(name))) files.push_back(manifest.at(name));
  }
  return files;
}

}  // namespace

ValidateOptions::ValidateOptions(Tool& tool)
    : tool_(tool),
      files_(tool, "assets (.glint); 'name.<UDIM>.glint': all tiles of a UDIM set", "FILE", false, UdimSets::taken) {
  tool.flag("--warnings-as-errors", warnings_as_errors_, "exit with 3 if there are warnings");
  tool.flag("--quick", quick_, "check structure and indices only, not hashes and values");
  tool.option("--since", since_,
              "manifest of glint-farm: check only files that are new or changed since a run has recorded them; without FILE, "
              "those of the "
              "manifest")
      .defaultText("none")
      .unrecorded();
  tool.option("--junit", junit_, "write the result as JUnit XML, too").defaultText("none").unrecorded();
  tool.option("--sarif", sarif_, "write the findings as SARIF 2.1.0, too").defaultText("none").unrecorded();
  tool.addCheck([this] { check(); });
}

void ValidateOptions::check() {
  if (files_.paths().empty() && since_.empty())
    throw Error(ErrorCode::usage, "cli.usage", "", "FILE", "there is nothing to check", "name assets, or --since MANIFEST");
  if (!since_.empty()) {
    checkRegular(since_);
    tool_.addInput(since_);
  }
  for (const std::string& report : {junit_, sarif_}) {
    if (report.empty()) continue;
    checkOutput(tool_, report, OutputFormat::test_report);
    tool_.addOutput(report);
  }
}

std::vector<std::string> ValidateOptions::files() const {
  if (since_.empty()) return files_.paths();
  const Manifest manifest = readManifest(since_);
  const EntryRecords records(manifest);
  std::vector<std::string> files = files_.paths().empty() ? assetsOf(manifest) : files_.paths();
  std::erase_if(files, [&](const std::string& file) { return records.isRecorded(seenBy(manifest, file)); });
  return files;
}

void ValidateOptions::write(std::span<const formats::ValidationReport> reports) const {
  const std::string generator = tool_.generator();
  const std::string version = generator.substr(generator.rfind(' ') + 1);
  if (!junit_.empty()) writeTextFile(junit_, junitReport(reports, warnings_as_errors_));
  if (!sarif_.empty()) {
    const auto json = sarifReport(reports, version);
    writeTextFile(sarif_, json.dump(1, ' ', false, nlohmann::ordered_json::error_handler_t::replace) + "\n");
  }
}

}  // namespace glint::apps
