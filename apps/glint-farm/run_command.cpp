#include "glint-farm/run_command.h"

#include <algorithm>
#include <filesystem>
#include <nlohmann/json.hpp>
#include <system_error>

#include "common/memory.h"
#include "common/part.h"
#include "common/signals.h"
#include "glint-farm/farm.h"
#include "glint-farm/shards.h"

namespace glint::apps {
namespace {

constexpr int kMostJobs = static_cast<int>(kMostChildren);
constexpr int kMostShards = 1000000;

/// The number behind the last blank: "0.1.0".
std::string versionOf(const std::string& generator) { return generator.substr(generator.rfind(' ') + 1); }

void requireOurVersion(const Manifest& manifest, const std::string& ours) {
  if (versionOf(manifest.generator) == versionOf(ours)) return;
  throw Error(ErrorCode::unsupported, "farm.version", manifest.path, "",
              "was planned for version " + versionOf(manifest.generator) + ", and this is version " + versionOf(ours),
              "run glint-farm plan again");
}

}  // namespace

ToolInfo FarmRunCommand::info() {
  return {"glint-farm run",
          "Makes the assets of a manifest that are missing, changed or damaged. Several may run on "
          "one manifest at once, on one machine or "
          "on many that see its folder. To go on after an interruption, run it again.",
          "glint-farm run farm.json --jobs 4"};
}

FarmRunCommand::FarmRunCommand(Tool& tool) : tool_(tool), manifest_(tool, "manifest of glint-farm plan (.json)", "MANIFEST") {
  tool.option("--shard", shard_, "make one part of the assets: I/N is part I of N, from 1/N to N/N")
      .defaultText("1/1")
      .unrecorded();
  tool.option("--jobs,-j", jobs_, "programs that run at once; each gets its share of --threads and --max-memory")
      .range(1, kMostJobs)
      .unrecorded();
  tool.option("--retries", retries_, "further tries of an asset, where another try may help").range(0, 1000).unrecorded();
  tool.option("--log", log_, "add a line of JSON for every asset to this file: docs/json/files/farm-log.schema.json")
      .defaultText("none")
      .unrecorded();
  tool.flag("--check", check_, "read every asset again, instead of trusting what was recorded about it");
  tool.addCheck([this] { check(); });
}

void FarmRunCommand::check() {
  if (!log_.empty()) {
    checkOutput(tool_, log_, OutputFormat::farm_log);
    tool_.addOutput(log_);
  }
  if (shard_.empty()) return;
  const Part part = parsePart(shard_, "--shard", kMostShards);
  shard_index_ = static_cast<std::size_t>(part.index - 1), shard_count_ = static_cast<std::size_t>(part.count);
}

std::vector<std::string> FarmRunCommand::flags() const {
  std::vector<std::string> flags = {"--threads", std::to_string(std::max(1, tool_.threads() / jobs_))};
  if (memoryLimit() > 0)
    flags.insert(flags.end(), {"--max-memory", std::to_string(memoryLimit() / static_cast<std::uint64_t>(jobs_))});
  if (tool_.trust()) flags.emplace_back("--trust");
  return flags;
}

void FarmRunCommand::run() {
  const Manifest manifest = readManifest(manifest_.path());
  requireOurVersion(manifest, tool_.generator());
  requireKeys(manifest);
  std::error_code none;
  if (!log_.empty() &&
      std::filesystem::weakly_canonical(log_, none) == std::filesystem::weakly_canonical(manifest.logPath(), none)) {
    throw Error(ErrorCode::usage, "cli.usage", log_, "--log", "is the file in which the manifest's own records are kept",
                "name another file, or leave out --log: the records have the same lines");
  }
  const StopScope stop;
  EntryRecords records(manifest);
  HashCache hashes(manifest.hashesPath());
  EntryMaker maker(manifest, records, hashes, flags(), check_);
  const std::vector<std::size_t> entries = shardOf(manifest, shard_index_, shard_count_);
  RunReport report(tool_, records, log_, entries.size());
  runFarm(manifest, entries, maker, report, {jobs_, retries_, [&] { return stop.stopped() != 0; }});
  hashes.save();
  if (const int signal = stop.stopped()) {
    tool_.warn("stopped by a signal; run it again to go on");
    endBySignal(signal);
  }
  tool_.setResult(report.json());
  tool_.summary(report.text());
  if (report.hasFailures()) tool_.setExitCode(ErrorCode::failed);
}

}  // namespace glint::apps
