#include "glint-farm/entry_maker.h"

#include <algorithm>
#include <csignal>
#include <filesystem>
#include <fstream>

#include "common/child_process.h"
#include "common/error_json.h"
#include "common/files.h"
#include "glint/formats/atomic_file.h"
#include "glint/model/error.h"

namespace glint::apps {
namespace {

namespace fs = std::filesystem;
using Json = nlohmann::ordered_json;
using Outcome = EntryTry::Outcome;

constexpr int kSignalled = 128;  // exit codes above it are signals

EntryTry failure(const Error& error) {
  EntryTry result;
  result.exit_code = static_cast<int>(error.code());
  result.may_help_again = error.code() == ErrorCode::io || error.code() == ErrorCode::failed;
  result.error = errorJson(error);
  return result;
}

/// The error of a program: as it says itself, or how it ended.
Json errorOf(const ChildRun& run, const std::string& program) {
  const Json document = Json::parse(run.output, nullptr, false);
  if (document.is_object() && document.contains("error")) return document.at("error");
  if (run.exit_code > kSignalled) {
    return errorJson(Error(ErrorCode::failed, "process.signal", "", "",
                           program + " was ended by signal " + std::to_string(run.exit_code - kSignalled),
                           "if it was 9, the machine may lack memory: give fewer --jobs, or --max-memory"));
  }
  return errorJson(Error(ErrorCode::failed, "process.failed", "", "",
                         program + " ended with exit code " + std::to_string(run.exit_code) + ": " + run.message));
}

bool saysUnchanged(const ChildRun& run) {
  const Json document = Json::parse(run.output, nullptr, false);
  return document.is_object() && document.value("status", Json()) == "unchanged";
}

/// Whether a second try may end otherwise: what is wrong with flags and maps stays wrong.
bool mayHelpAgain(int exit_code) {
  constexpr ErrorCode kFinal[] = {ErrorCode::usage, ErrorCode::invalid_input, ErrorCode::unsupported, ErrorCode::differs};
  return std::none_of(std::begin(kFinal), std::end(kFinal),
                      [&](ErrorCode code) { return exit_code == static_cast<int>(code); });
}

void makeFolderOf(const std::string& file) {
  const fs::path folder = fs::path(file).parent_path();
  std::error_code error;
  if (!folder.empty()) fs::create_directories(folder, error);
  if (error)
    throw Error(ErrorCode::io, "output.folder", file, "",
                "the folder " + folder.string() + " cannot be made: " + error.message(),
                "check the permissions and the space of the disk");
}

/// Copies a file, whole or not at all, without holding all of it.
void copyFile(const std::string& file, const std::string& name) {
  std::ifstream from(file, std::ios::binary);
  std::vector<char> piece(8 << 20);
  formats::AtomicFile copy(name);
  std::uint64_t size = 0;
  while (from.read(piece.data(), static_cast<std::streamsize>(piece.size())), from.gcount() > 0) {
    const auto count = static_cast<std::uint64_t>(from.gcount());
    copy.write(piece.data(), count, size);
    size += count;
  }
  if (!from.eof())
    throw Error(ErrorCode::io, "file.readable", file, "", "cannot be read", "check its permissions and the disk");
  copy.publish(true);
}

/// Gives a file a second name, in place of an asset that has it. Where file systems have no links, makes a copy.
void makeLink(const std::string& file, const std::string& name) {
  std::error_code error;
  if (fs::equivalent(file, name, error)) return;
  makeFolderOf(name);
  if (fs::exists(name, error)) checkReplaceable(name, name, OutputFormat::asset);
  const std::string temporary = (fs::path(name).parent_path() / ("." + fs::path(name).filename().string() + ".0.tmp")).string();
  fs::remove(temporary, error);
  fs::create_hard_link(file, temporary, error);
  if (!error) fs::rename(temporary, name, error);
  if (!error) return;
  fs::remove(temporary, error);
  copyFile(file, name);
}

}  // namespace

bool EntryMaker::isKnown(const ManifestEntry& entry) {
  try {
    return !recheck_ && records_.stateOf(entry) == EntryState::done && !changedMap(manifest_, entry, hashes_);
  } catch (const Error&) {
    return false;  // a map that cannot be read: make() says why
  }
}

EntryTry EntryMaker::make(const ManifestEntry& entry) {
  try {
    makeFolderOf(manifest_.at(entry.output));
    std::optional<EntryLock> lock = EntryLock::take(manifest_.at(entry.output));
    if (!lock) {
      EntryTry busy;
      busy.outcome = Outcome::busy;
      return busy;
    }
    records_.refresh();
    if (isKnown(entry)) {
      EntryTry known;
      known.outcome = Outcome::known;
      return known;
    }
    if (const auto map = changedMap(manifest_, entry, hashes_))
      throw Error(ErrorCode::invalid_input, "farm.map_changed", *map, "",
                  "is not the map that was planned: its bytes have changed", "run glint-farm plan again");
    EntryTry result = runLocked(entry, lock->file());
    if (result.outcome == Outcome::made || result.outcome == Outcome::unchanged) result.lock.emplace(std::move(*lock));
    return result;
  } catch (const Error& error) {
    return failure(error);
  }
}

EntryTry EntryMaker::runLocked(const ManifestEntry& entry, int lock) {
  std::vector<std::string> words = entry.command;
  words.insert(words.end(), {"--skip-unchanged", "--json", "--progress", "none"});
  words.insert(words.end(), flags_.begin(), flags_.end());
  const ChildRun run = runProgram(words, {.keep_output = true, .folder = manifest_.folder, .shared_file = lock});
  EntryTry result;
  result.exit_code = run.exit_code;
  result.wall_s = run.wall_s, result.cpu_s = run.cpu_s, result.peak_bytes = run.peak_bytes;
  if (run.exit_code == 0) {
    makeLinks(entry);
    result.outcome = saysUnchanged(run) ? Outcome::unchanged : Outcome::made;
  } else {
    const bool by_us = run.exit_code == kSignalled + SIGTERM || run.exit_code == kSignalled + SIGINT;
    result.outcome = by_us ? Outcome::stopped : Outcome::failed;
    result.may_help_again = mayHelpAgain(run.exit_code);
    result.error = errorOf(run, words.front());
  }
  return result;
}

void EntryMaker::makeLinks(const ManifestEntry& entry) const {
  for (const std::string& link : entry.links) makeLink(manifest_.at(entry.output), manifest_.at(link));
}

}  // namespace glint::apps
