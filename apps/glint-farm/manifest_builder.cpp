#include "glint-farm/manifest_builder.h"

#include <tbb/parallel_for.h>

#include <algorithm>
#include <atomic>
#include <mutex>

#include "glint/model/error.h"

namespace glint::apps {
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
  return sourceOfMap(file, hashes_.hash(file, manifest_.at(file)));
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
  ManifestEntry entry{"", job.output, {}, {}, job.command, job.inputs, {}};
  const std::string key = keyOf(manifest_.generator, entry, [this](const std::string& file) { return sourceKey(file); });
  entry.key = key;
  if (const auto known = maker_of_.find(job.output); known != maker_of_.end() && known->second == key) return;
  claim(job.output, key);
  if (const auto same = manifest_.entry_of_key.find(key); same != manifest_.entry_of_key.end()) {
    ManifestEntry& first = manifest_.entries[same->second];
    first.links.push_back(job.output);
    for (const std::string& input : job.inputs)
      if (maps_.contains(input) && std::find(first.inputs.begin(), first.inputs.end(), input) == first.inputs.end())
        first.twins.push_back(input);
    ++duplicates_;
    return;
  }
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
