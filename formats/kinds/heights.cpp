#include <cmath>

#include "glint/formats/kinds/codec.h"
#include "glint/formats/kinds/texel_tally.h"

namespace glint::formats {

PackedAsset pack(const HeightMap& map) {
  PackedAsset packed{"heights", {}, {}};
  packed.integer("width", map.width);
  packed.integer("height", map.height);
  packed.real("texel_size_um", map.texel_size_um);
  packed.array("heights", ElementType::f32, {static_cast<std::uint64_t>(map.height), static_cast<std::uint64_t>(map.width)},
               map.heights.data(), map.heights.size());
  return packed;
}

void unpack(const Content& content, HeightMap& map) {
  map.width = content.integer("width");
  map.height = content.integer("height");
  map.texel_size_um = content.real("texel_size_um");
  map.heights = content.array<float>("heights");
}

void checkIndex(const HeightMap&, Findings&) {}

void checkData(const HeightMap& map, Findings& findings) {
  TexelTally infinite(map.width, map.height);
  for (std::size_t k = 0; k < map.heights.size(); ++k)
    if (!std::isfinite(map.heights[k])) infinite.add(k);
  report(infinite, "heights.finite", "/heights", "texels are not finite", findings);
}

}  // namespace glint::formats
