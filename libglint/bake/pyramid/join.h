#pragma once

#include <cstdint>
#include <memory_resource>
#include <span>
#include <vector>

#include "glint/model/ndf_pyramid_shard.h"

namespace glint::bake {

/// The shape of the pyramid that shards join to, which is the one of buildPyramid: where levels are to agree, the coarse levels that
/// agree are dropped.
/// @param shards  all regions of one pyramid, in order
PyramidShape joinedShape(std::span<const NdfPyramidShard> shards);

/// The level of shards that is level `level` of the pyramid that they join to. The mean of the map stays the last level.
int levelInShards(const NdfPyramidShard& shard, const PyramidShape& joined, int level);

/// mask_ranks of a level of the joined pyramid. Its other arrays are those of the shards, one after the other.
/// @param level  of the shards
/// @return in memory of the default resource
/// @throws Error failed if the level has more blocks than 32 bits count
std::pmr::vector<std::uint32_t> joinedRanks(std::span<const NdfPyramidShard> shards, int level);

}  // namespace glint::bake
