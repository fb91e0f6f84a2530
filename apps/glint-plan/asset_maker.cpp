#include "glint-plan/asset_maker.h"

#include <fmt/format.h>
#include <unistd.h>

#include <algorithm>
#include <filesystem>
#include <nlohmann/json.hpp>

#include "common/child_process.h"
#include "glint-plan/plan_candidates.h"

namespace glint::apps {

namespace fs = std::filesystem;

AssetMaker::AssetMaker(Tool& tool, const AssetFolder& folder, std::string hash, std::string label, std::string path,
                       std::vector<Candidate> all, float sigma_r)
    : tool_(tool),
      folder_(folder),
      hash_(std::move(hash)),
      label_(std::move(label)),
      path_(std::move(path)),
      all_(std::move(all)),
      sigma_r_(sigma_r) {}

const MadeAsset& AssetMaker::make(const Candidate& candidate) {
  const std::string name = candidate.name();
  if (const auto made = made_.find(name); made != made_.end()) return made->second;
  const auto bytesOf = [](const std::string& file) { return static_cast<double>(std::filesystem::file_size(file)); };
  if (candidate.tool.empty()) return made_[name] = {path_, bytesOf(path_), 0};
  if (const auto failed = failed_.find(name); failed != failed_.end())
    throw Error(ErrorCode::failed, "plan.candidate", "", "", failed->second);
  const Candidate* source = sourceOf(all_, candidate);
  const MadeAsset input = source != nullptr ? make(*source) : MadeAsset{path_, 0, 0};
  MadeAsset made;
  made.file = folder_.fileOf(hash_, label_ + " " + name);
  std::vector<std::string> words = {candidate.tool, input.file, "-o", made.file};
  words.insert(words.end(), candidate.flags.begin(), candidate.flags.end());
  words.insert(words.end(), {"--force", "--quiet"});
  for (const std::string& flag : childFlags(tool_)) words.push_back(flag);
  const bool compresses = source != nullptr;
  if (compresses) words.push_back("--json");
  const ChildRun run = runProgram(words, {.keep_output = compresses, .shared_file = folder_.lock()});
  if (run.exit_code != 0) {
    failed_[name] = run.message;
    throw Error(ErrorCode::failed, "plan.candidate", "", "", run.message);
  }
  made.bytes = bytesOf(made.file);
  // Where other programs take processors away, the program waits; alone it would take no longer than all its threads one by one.
  made.seconds = input.seconds + std::min(run.wall_s, run.cpu_s);
  if (compresses) made.reached = nlohmann::json::parse(run.output).at("result").at("total").at("seen").get<double>();
  return made_[name] = made;
}

api::OpenedNdf AssetMaker::open(const Candidate& candidate) { return openFile(candidate, make(candidate).file, path_); }

api::OpenedNdf AssetMaker::openFile(const Candidate& candidate, const std::string& file, const std::string& map) const {
  api::NdfOptions options;
  options.sigma_r = sigma_r_;
  if (candidate.takes_normals) options.normals = map;
  return api::OpenedNdf::open(file, options);
}

std::optional<std::string> AssetMaker::copyOf(const std::string& file, int number) const {
  const std::string label = fs::path(file).filename().string();
  const std::string copy = folder_.fileOf(hash_, fmt::format("copy {} {} {}", ::getpid(), number, label));
  std::error_code error;
  fs::copy_file(file, copy, error);
  if (!error) return copy;
  if (error != std::errc::file_exists) fs::remove(copy, error);
  return std::nullopt;
}

std::list<api::OpenedNdf> AssetMaker::openCopies(const Candidate& candidate, int count) {
  const std::string original = make(candidate).file;
  std::list<api::OpenedNdf> copies;
  copies.push_back(openFile(candidate, original, path_));
  for (int k = 1; k < count; ++k) {
    const std::optional<std::string> copy = copyOf(original, k);
    const std::optional<std::string> map = candidate.takes_normals && copy ? copyOf(path_, k) : path_;
    if (copy && map) copies.push_back(openFile(candidate, *copy, *map));
    std::error_code none;
    if (copy) fs::remove(*copy, none);
    if (map && *map != path_) fs::remove(*map, none);
    if (!copy || !map) break;  // the disk is full
  }
  return copies;
}

}  // namespace glint::apps
