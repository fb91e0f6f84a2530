#include "glint-farm/manifest_builder.h"

#include <tbb/parallel_for.h>

#include <algorithm>
#include <atomic>
#include <filesystem>
#include <mutex>
#include <nlohmann/json.hpp>

#include "glint/formats/hash.h"
#include "glint/model/error.h"

namespace glint::apps {
namespace {

using Json = nlohmann::ordered_json;

/// Ending of a file's name, in small letters: some readers of images go by it.
std::string endingOf(const std::string& file) {
  std::string ending = std::filesystem::path(file).extension().string();
  for (char& c : ending) c = static_cast<char>(std::tolower(static_cast<unsigned char>(c)));
  return ending;
}

}  // namespace

ManifestBuilder::ManifestBuilder(const Tool& tool, const std::string& path) : hashes_(path + ".hashes") {
  manifest_.path = path;
  manifest_.folder = manifestFolder(path);
  const std::string generator = tool.generator();
  manifest_.generator = "glint-farm" + generator.substr(generator.rfind(' '));
}

void ManifestBuilder::hashMaps(const std::vector<std::string>& files, const bake::ProgressFn& progress) {
  constexpr std::size_t kBetweenSaves = 1024;  // so that a run that is stopped has not read in vain
  std::mutex mutex;
  std::size_t done = 0;
  for (std::size_t begin = 0; begin < files.size(); begin += kBetweenSaves) {
    tbb::parallel_for(begin, std::min(begin + kBetweenSaves, files.size()), [&](std::size_t k) {
      hashes_.hash(files[k], manifest_.at(files[k]));
      const std::lock_guard lock(mutex);
      if (++done; progress) progress(done, files.size());
    });
    hashes_.save();
  }
}

std::string ManifestBuilder::sourceKey(const std::string& file) {
  if (const auto maker = maker_of_.find(file); maker != maker_of_.end()) return maker->second;
  maps_.insert(file);
  return hashes_.hash(file, manifest_.at(file)) + endingOf(file);
}

std::string ManifestBuilder::keyOf(const FarmJob& job) {
  // Files stand in the key as what they hold, not as how they are named.
  Json words = Json::array({manifest_.generator});
  for (const std::string& word : job.command) {
    const auto input = std::find(job.inputs.begin(), job.inputs.end(), word);
    if (word == job.output)
      words.push_back({{"output", true}});
    else if (input != job.inputs.end())
      words.push_back({{"input", sourceKey(word)}});
    else
      words.push_back(word);
  }
  const std::string text = words.dump(-1, ' ', false, Json::error_handler_t::replace);
  return formats::hashBytes(text.data(), text.size());
}

void ManifestBuilder::claim(const std::string& output, const std::string& key) {
  const auto [place, is_new] = maker_of_.emplace(output, key);
  if (is_new || place->second == key) return;
  throw Error(ErrorCode::usage, "farm.output", output, "", "two different assets would have this name",
              "rename one of the maps, or plan them into different folders with --assets");
}

void ManifestBuilder::add(FarmJob job) {
  for (std::string& input : job.inputs) {
    // What is made of a duplicate is made of the entry that stands for it.
    const auto maker = maker_of_.find(input);
    if (maker == maker_of_.end()) continue;
    const std::string& first = manifest_.entries[manifest_.entry_of_key.at(maker->second)].output;
    std::replace(job.command.begin(), job.command.end(), input, first);
    input = first;
  }
  const std::string key = keyOf(job);
  if (const auto known = maker_of_.find(job.output); known != maker_of_.end() && known->second == key) return;
  claim(job.output, key);
  if (const auto same = manifest_.entry_of_key.find(key); same != manifest_.entry_of_key.end()) {
    ManifestEntry& entry = manifest_.entries[same->second];
    entry.links.push_back(job.output);
    for (const std::string& input : job.inputs)
      if (maps_.contains(input) && std::find(entry.inputs.begin(), entry.inputs.end(), input) == entry.inputs.end())
        entry.twins.push_back(input);
    ++duplicates_;
    return;
  }
  ManifestEntry entry{key, job.output, {}, {}, job.command, job.inputs, {}};
  for (const std::string& input : job.inputs)
    if (const auto maker = maker_of_.find(input); maker != maker_of_.end()) entry.after.push_back(maker->second);
  manifest_.entry_of_key.emplace(key, manifest_.entries.size());
  manifest_.entries.push_back(std::move(entry));
}

Manifest ManifestBuilder::take() {
  hashes_.save();
  for (const std::string& map : maps_) manifest_.maps.push_back({map, hashes_.hash(map, manifest_.at(map))});
  manifest_.index();
  return std::move(manifest_);
}

}  // namespace glint::apps
