#include "glint/bake/bin_map/texel_classes.h"

#include <tbb/parallel_for.h>

#include <algorithm>

#include "glint/model/bin_map.h"

namespace glint::bake {
namespace {

// Classes of four texels fill three words. Parts of a map begin at multiples of four texels, so no two threads write one word.
static_assert(4 * BinMap::kClassBits == 3 * 16 && kBinChunk % 4 == 0);

/// Makes a class of every block, or of several blocks with about equal numbers of texels.
/// @param block_classes  [blocks]: class of each block
/// @return as BinMap::class_keys
std::vector<std::uint32_t> makeClasses(const BlockTrees& trees, std::size_t texel_count, std::size_t key_count,
                                       std::vector<std::uint16_t>& block_classes) {
  const std::uint64_t wanted = trees.blocks.size() <= BinMap::kMaxClasses ? 1 : texel_count / (BinMap::kMaxClasses - 1) + 1;
  std::vector<std::uint32_t> class_keys{0};
  block_classes.reserve(trees.blocks.size());
  std::uint64_t texels = 0;
  for (const BinBlock& block : trees.blocks) {
    if (texels >= wanted) {
      class_keys.push_back(block.first_key);
      texels = 0;
    }
    block_classes.push_back(static_cast<std::uint16_t>(class_keys.size() - 1));
    texels += block.texels;
  }
  class_keys.push_back(static_cast<std::uint32_t>(key_count));
  return class_keys;
}

/// Packs classes of 12 bits in words of 16.
void packClasses(const std::uint16_t* classes, std::size_t count, std::uint16_t* words) {
  for (std::size_t k = 0; k < count; k += 4, words += 3) {
    std::uint64_t packed = 0;
    const std::size_t n = std::min<std::size_t>(4, count - k);
    for (std::size_t i = 0; i < n; ++i) packed |= std::uint64_t{classes[k + i]} << (BinMap::kClassBits * i);
    for (std::size_t w = 0; w < (n * BinMap::kClassBits + 15) / 16; ++w)
      words[w] = static_cast<std::uint16_t>(packed >> (16 * w));
  }
}

}  // namespace

TexelClasses classifyTexels(const NormalMap& map, const BinGrid& grid, const BlockTrees& trees) {
  const std::size_t count = map.normals.size();
  TexelClasses result;
  std::vector<std::uint16_t> block_classes;
  result.class_keys = makeClasses(trees, count, grid.key_count, block_classes);
  result.texel_classes.resize((count * BinMap::kClassBits + 15) / 16);
  tbb::parallel_for(std::size_t{0}, kMapParts, [&](std::size_t part) {
    visitBinned(map, grid, part, [&](const BinnedChunk& chunk) {
      std::uint16_t classes[kBinChunk];
      for (std::size_t k = 0; k < chunk.count; ++k) classes[k] = block_classes[trees.bin_blocks[chunk.keys[k]]];
      packClasses(classes, chunk.count, result.texel_classes.data() + chunk.first * BinMap::kClassBits / 16);
    });
  });
  return result;
}

}  // namespace glint::bake
