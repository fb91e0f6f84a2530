#include "glint-farm/shards.h"

#include <numeric>

namespace glint::apps {
namespace {

/// The first entry of the group that an entry is in.
std::size_t rootOf(std::vector<std::size_t>& parents, std::size_t entry) {
  while (parents[entry] != entry) entry = parents[entry] = parents[parents[entry]];
  return entry;
}

}  // namespace

std::vector<std::size_t> shardOf(const Manifest& manifest, std::size_t index, std::size_t count) {
  std::vector<std::size_t> parents(manifest.entries.size());
  std::iota(parents.begin(), parents.end(), std::size_t{0});
  for (std::size_t k = 0; k < parents.size(); ++k) {
    for (const std::string& key : manifest.entries[k].after) {
      const std::size_t a = rootOf(parents, k), b = rootOf(parents, manifest.entry_of_key.at(key));
      parents[std::max(a, b)] = std::min(a, b);
    }
  }
  // Groups are dealt out in the order of their first entries.
  std::vector<std::size_t> group(parents.size()), entries;
  std::size_t groups = 0;
  for (std::size_t k = 0; k < parents.size(); ++k) {
    const std::size_t root = rootOf(parents, k);
    group[k] = root == k ? groups++ : group[root];
    if (group[k] % count == index) entries.push_back(k);
  }
  return entries;
}

}  // namespace glint::apps
