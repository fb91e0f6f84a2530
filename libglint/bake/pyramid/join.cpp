#include "glint/bake/pyramid/join.h"

#include <algorithm>
#include <limits>
#include <string>

#include "glint/bake/pyramid/agreement.h"
#include "glint/model/error.h"

namespace glint::bake {

PyramidShape joinedShape(std::span<const NdfPyramidShard> shards) {
  PyramidShape shape = shards.front().images.shape;
  if (shards.front().level_choice == LevelChoice::given) return shape;
  const PyramidShape whole = shape;
  const int kept = disagreeingLevels(whole, [&](int level, std::size_t image, std::vector<float>& pixels) {
    const auto columns = static_cast<std::size_t>(whole.levels[level].columns);
    const int row = static_cast<int>(image / columns);
    const NdfPyramidShard& shard = *std::find_if(
        shards.begin(), shards.end(), [&](const NdfPyramidShard& s) { return row < regionRows(whole, level, s.region).end; });
    const auto first = static_cast<std::size_t>(regionRows(whole, level, shard.region).first);
    decodeImage(shard.images, level, image - first * columns, pixels);
  });
  keepLevels(shape, kept);
  return shape;
}

int levelInShards(const NdfPyramidShard& shard, const PyramidShape& joined, int level) {
  return level < joined.footprintLevels() ? level : shard.images.shape.level_count - 1;
}

std::pmr::vector<std::uint32_t> joinedRanks(std::span<const NdfPyramidShard> shards, int level) {
  std::size_t words = 1;
  for (const NdfPyramidShard& shard : shards) words += shard.images.levels[level].masks.size();
  std::pmr::vector<std::uint32_t> ranks;
  ranks.reserve(words);
  std::uint64_t blocks = 0;
  for (const NdfPyramidShard& shard : shards) {
    const std::span<const std::uint32_t> own = shard.images.levels[level].mask_ranks;
    if (blocks + own.back() > std::numeric_limits<std::uint32_t>::max())
      throw Error(ErrorCode::failed, "pyramid.mask_ranks", {}, "level " + std::to_string(level),
                  "would have more blocks than 32 bits count",
                  "give a larger --stride, or a smaller --resolution or --overlap");
    for (const std::uint32_t rank : own.first(own.size() - 1)) ranks.push_back(static_cast<std::uint32_t>(blocks) + rank);
    blocks += own.back();
  }
  ranks.push_back(static_cast<std::uint32_t>(blocks));
  return ranks;
}

}  // namespace glint::bake
