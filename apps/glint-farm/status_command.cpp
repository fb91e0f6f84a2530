#include "glint-farm/status_command.h"

#include <fmt/format.h>

#include <algorithm>
#include <nlohmann/json.hpp>

#include "glint-farm/entry_lock.h"
#include "glint/model/error.h"
#include "glint/model/memory_text.h"
#include "glint/model/shown_text.h"
#include "manifest/entry_records.h"
#include "manifest/hash_cache.h"

namespace glint::apps {
namespace {

using nlohmann::json;

/// Sums over the entries of a manifest.
struct FarmStatus {
  std::size_t entries = 0, done = 0, running = 0, changed = 0, failed = 0, not_made = 0, to_make = 0;
  double program_s = 0, cpu_s = 0, bytes = 0;
  std::int64_t peak_bytes = 0;
  json failures = json::array();

  void addDone(const Manifest& manifest, const ManifestEntry& entry, const nlohmann::ordered_json& line) {
    ++done;
    program_s += line.value("wall_s", 0.0), cpu_s += line.value("cpu_s", 0.0);
    peak_bytes = std::max(peak_bytes, line.value("peak_bytes", std::int64_t{0}));
    if (const auto stamp = stampOf(manifest.at(entry.output))) bytes += static_cast<double>(stamp->size_bytes);
  }

  void addFailed(const ManifestEntry& entry, const nlohmann::ordered_json& line) {
    ++failed;
    const auto error = line.value("error", nlohmann::ordered_json::object());
    failures.push_back({{"output", entry.output},
                        {"rule", error.value("rule", std::string())},
                        {"message", error.value("message", std::string())}});
  }
};

/// Whether the maps of an entry are those that were planned; not so, if one of them cannot be read.
bool readsPlannedMaps(const Manifest& manifest, const ManifestEntry& entry, HashCache& hashes) {
  try {
    return !changedMap(manifest, entry, hashes);
  } catch (const Error&) {
    return false;
  }
}

void addEntry(FarmStatus& status, const Manifest& manifest, const EntryRecords& records, HashCache& hashes,
              const ManifestEntry& entry) {
  const EntryState state = records.stateOf(entry);
  const auto line = records.lastLine(entry.key).value_or(nlohmann::ordered_json::object());
  const std::string last = line.value("status", std::string());
  if (state == EntryState::done && readsPlannedMaps(manifest, entry, hashes)) return status.addDone(manifest, entry, line);
  if (EntryLock::isTaken(manifest.at(entry.output))) {
    ++status.running;
  } else if (last == "failed") {
    status.addFailed(entry, line);
  } else if (last == "not_made") {
    ++status.not_made;
  } else if (state != EntryState::missing) {
    ++status.changed;
  } else {
    ++status.to_make;
  }
}

json jsonOf(const FarmStatus& s) {
  return {{"entries", s.entries},       {"done", s.done},           {"running", s.running},
          {"changed", s.changed},       {"failed", s.failed},       {"not_made", s.not_made},
          {"to_make", s.to_make},       {"program_s", s.program_s}, {"cpu_s", s.cpu_s},
          {"peak_bytes", s.peak_bytes}, {"bytes", s.bytes},         {"failures", s.failures}};
}

std::string textOf(const FarmStatus& s) {
  std::string text = fmt::format("{} of {} assets are done", s.done, s.entries);
  for (const auto& [number, what] :
       {std::pair{s.running, "being made"}, std::pair{s.changed, "changed since they were made"}, std::pair{s.failed, "failed"},
        std::pair{s.not_made, "not made, because they need one that failed"}, std::pair{s.to_make, "to make"}})
    if (number > 0) text += fmt::format("; {} {}", number, what);
  text += fmt::format("\n{} in {:.1f} s of programs, {} of memory at most\n", memoryText(s.bytes), s.program_s,
                      memoryText(static_cast<double>(s.peak_bytes)));
  for (const json& failure : s.failures)
    text +=
        fmt::format("{}: [{}] {}\n", escapedText(failure.at("output").get<std::string>()),
                    escapedText(failure.at("rule").get<std::string>()), escapedText(failure.at("message").get<std::string>()));
  return text;
}

}  // namespace

ToolInfo FarmStatusCommand::info() {
  return {"glint-farm status", "Says how many assets of a manifest are made, and why others are not.",
          "glint-farm status farm.json"};
}

FarmStatusCommand::FarmStatusCommand(Tool& tool)
    : tool_(tool), manifest_(tool, "manifest of glint-farm plan (.json)", "MANIFEST") {}

void FarmStatusCommand::run() {
  const Manifest manifest = readManifest(manifest_.path());
  requireKeys(manifest);
  const EntryRecords records(manifest);
  HashCache hashes(manifest.hashesPath());
  FarmStatus status;
  status.entries = manifest.entries.size();
  for (const ManifestEntry& entry : manifest.entries) addEntry(status, manifest, records, hashes, entry);
  tool_.setResult(jsonOf(status));
  tool_.print(textOf(status));
}

}  // namespace glint::apps
