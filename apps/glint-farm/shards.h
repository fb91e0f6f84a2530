#pragma once

#include <cstddef>
#include <vector>

#include "manifest/manifest.h"

namespace glint::apps {

/// Entries of one of `count` shards. Entries that need each other are in one shard, so that shards do not wait for each other.
/// @param index  from 0
/// @note every entry is in exactly one shard, whatever the machine
std::vector<std::size_t> shardOf(const Manifest& manifest, std::size_t index, std::size_t count);

}  // namespace glint::apps
