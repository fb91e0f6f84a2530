#include "glint/bake/bin_map/bin_grid.h"

#include "glint/bake/common/simd.h"

namespace glint::bake {
namespace {

/// Moves bit k of x to bit 2 k. The bits of a column and of a row, spread and interleaved, are the key of a bin in its tile.
std::uint32_t spreadBits(std::uint32_t x) {
  std::uint32_t spread = 0;
  for (int k = 0; k < 16; ++k) spread |= (x >> k & 1) << 2 * k;
  return spread;
}

/// binNormals without references to structs, which would keep the compiler from making vectors.
GLINT_MULTIVERSION bool binAll(const Vec2* normals, std::size_t count, int bins, int subbin_bits, std::uint16_t* columns,
                               std::uint16_t* rows, std::uint16_t* subbins) {
  const float half = 0.5f * static_cast<float>(bins);
  const auto steps = static_cast<float>(1 << subbin_bits);
  const int last = bins - 1, last_step = (1 << subbin_bits) - 1;
  int bad = 0;
  for (std::size_t k = 0; k < count; ++k) {
    const float nx = normals[k].x, ny = normals[k].y;
    bad |= !(nx * nx + ny * ny < 1);
    const float x = (nx + 1) * half, y = (ny + 1) * half;
    const int column = std::min(static_cast<int>(x), last), row = std::min(static_cast<int>(y), last);
    const int px = std::min(static_cast<int>((x - static_cast<float>(column)) * steps), last_step);
    const int py = std::min(static_cast<int>((y - static_cast<float>(row)) * steps), last_step);
    columns[k] = static_cast<std::uint16_t>(column);
    rows[k] = static_cast<std::uint16_t>(row);
    subbins[k] = static_cast<std::uint16_t>(px | py << subbin_bits);
  }
  return bad == 0;
}

}  // namespace

BinGrid makeBinGrid(int bins_per_axis, int tile_bits, int subbin_bits) {
  BinGrid grid{bins_per_axis, tile_bits, subbin_bits, ((bins_per_axis - 1) >> tile_bits) + 1, 0, {}, {}};
  grid.key_count = grid.tileCount() * grid.keysPerTile();
  for (int k = 0; k < bins_per_axis; ++k) {
    const auto tile = static_cast<std::uint32_t>(k >> tile_bits);
    const std::uint32_t within = spreadBits(static_cast<std::uint32_t>(k) & ((1u << tile_bits) - 1));
    grid.column_keys.push_back((tile << 2 * tile_bits) + within);
    grid.row_keys.push_back((tile * static_cast<std::uint32_t>(grid.tiles_per_axis) << 2 * tile_bits) + 2 * within);
  }
  return grid;
}

bool binNormals(const Vec2* normals, std::size_t count, const BinGrid& grid, std::uint16_t* columns, std::uint16_t* rows,
                std::uint16_t* subbins) {
  return binAll(normals, count, grid.bins_per_axis, grid.subbin_bits, columns, rows, subbins);
}

}  // namespace glint::bake
