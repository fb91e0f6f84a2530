#pragma once

#include <set>
#include <string>
#include <unordered_map>
#include <vector>

#include "common/tool.h"
#include "manifest/hash_cache.h"
#include "manifest/manifest.h"

namespace glint::apps {

/// A program to run: words of the command, which names the inputs and the output.
struct FarmJob {
  std::vector<std::string> command;
  std::vector<std::string> inputs;
  std::string output;
};

/// Collects jobs as entries of a manifest: those that would make the same bytes become one entry.
class ManifestBuilder {
 public:
  /// @param path  of the manifest; names of files in jobs are those that its folder sees
  ManifestBuilder(const Tool& tool, const std::string& path);

  /// Hashes maps ahead, on all threads, and keeps the hashes beside the manifest.
  /// @throws Error io
  void hashMaps(const std::vector<std::string>& files, const bake::ProgressFn& progress);

  /// Adds a job. Jobs that make its inputs come first.
  /// @throws Error io; usage if two jobs would make one file of different bytes
  void add(FarmJob job);

  /// The manifest of all jobs.
  Manifest take();

  std::size_t duplicates() const { return duplicates_; }
  std::size_t hashedMaps() const { return hashes_.readFiles(); }

 private:
  std::string sourceKey(const std::string& file);
  void claim(const std::string& output, const std::string& key);

  Manifest manifest_;
  HashCache hashes_;
  std::set<std::string> maps_;                             ///< that jobs read
  std::unordered_map<std::string, std::string> maker_of_;  ///< output or link -> key
  std::size_t duplicates_ = 0;
};

}  // namespace glint::apps
