#include "glint/bake/ingest/tile_margins.h"

#include <cstdint>

namespace glint::bake {
namespace {

/// Whether texel x lies before, in or after the tile: -1, 0 or 1.
int sideOf(int x, int size) { return x < 0 ? -1 : x >= size ? 1 : 0; }

/// Texel x beyond a border, mirrored there.
int mirrored(int x, int size) { return x < 0 ? -1 - x : 2 * size - 1 - x; }

/// The texel of an axis of `from` texels at the place of texel x of an axis of `size` texels.
std::size_t texelAt(int x, int size, int from) {
  return static_cast<std::size_t>((2 * std::int64_t{x} + 1) * from / (2 * std::int64_t{size}));
}

}  // namespace

template <class T>
std::vector<T> withMargins(const TileNeighbourhood<T>& around, const std::array<int, 4>& margins) {
  const int width = around.at(0, 0).width, height = around.at(0, 0).height;
  std::vector<T> all;
  all.reserve(static_cast<std::size_t>(width + margins[0] + margins[2]) *
              static_cast<std::size_t>(height + margins[1] + margins[3]));
  for (int j = -margins[1]; j < height + margins[3]; ++j)
    for (int i = -margins[0]; i < width + margins[2]; ++i) {
      int x = i, y = j;
      if (around.at(sideOf(x, width), sideOf(y, height)).texels.empty()) {
        if ((i + j) % 2 == 0)
          x = mirrored(x, width);
        else
          y = mirrored(y, height);
      }
      const int dx = sideOf(x, width), dy = sideOf(y, height);
      const TileTexels<T>& from = around.at(dx, dy);
      all.push_back(from.texels[texelAt(y - dy * height, height, from.height) * static_cast<std::size_t>(from.width) +
                                texelAt(x - dx * width, width, from.width)]);
    }
  return all;
}

template std::vector<float> withMargins(const TileNeighbourhood<float>&, const std::array<int, 4>&);
template std::vector<Vec2> withMargins(const TileNeighbourhood<Vec2>&, const std::array<int, 4>&);

}  // namespace glint::bake
