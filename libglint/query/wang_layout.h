#pragma once

#include <cmath>
#include <cstdint>

#include "glint/math/hash.h"
#include "glint/math/vec.h"
#include "glint/model/wang_tiles.h"

namespace glint {

/// value / step, rounded down. `step` is positive.
inline GLINT_HD int floorDiv(int value, int step) { return value / step - (value % step < 0 ? 1 : 0); }

/// A place of the plane: a cell, and a position inside it. Whole numbers of 64 bits name the cell, so that places far out lose no
/// digits.
struct WangPlace {
  std::int64_t cell_x = 0, cell_y = 0;
  float x = 0, y = 0;  ///< texels from the lower left corner of the cell, in [0, size]
};

/// A cell of the plane, whose numbers wrap at 2^64, and a position in it: [0, 1)^2 from its lower left corner.
struct WangCell {
  std::uint64_t x, y;
  Vec2 at;
};

/// The cell of a position that counts in tiles from the lower left corner of cell (from_x, from_y). A coordinate that is not finite,
/// or so large that floats name no cells there, is 0 in that cell.
inline GLINT_HD WangCell wangCell(Vec2 position, std::uint64_t from_x, std::uint64_t from_y) {
  const auto split = [](float u, std::uint64_t from, float& at) {
    constexpr float kFarthest = 9e15f;  // whole numbers beyond are no cells that a float can name
    const float cell = std::floor(u);
    if (!(cell > -kFarthest && cell < kFarthest)) {
      at = 0;
      return from;
    }
    at = u - cell < 1 ? u - cell : float{kBelowOne};
    return from + static_cast<std::uint64_t>(static_cast<std::int64_t>(cell));
  };
  WangCell cell = {};
  cell.x = split(position.x, from_x, cell.at.x);
  cell.y = split(position.y, from_y, cell.at.y);
  return cell;
}

/// Which tile lies in which cell of a plane without end (Deng 2022, section 5.5, Fig. 13). Cell (i, j) covers the texels
/// [i size, (i+1) size) x [j size, (j+1) size).
///
/// Colours come from a hash of the vertex (i, j), which is the lower left corner of cell (i, j). Scheme edge: vertex (i, j) has
/// the colours of the edges that go east and north from it. (The paper's go east and south: its v points down.) Scheme corner:
/// the vertex has a colour itself. The cell's own hash chooses among the variants of a tile. There is no table: every cell is
/// found in O(1), and every processor finds the same. Cell numbers may be any; they wrap at 2^64.
class WangLayout {
 public:
  GLINT_HD explicit WangLayout(const WangTiles& tiles)
      : tiles_(tiles), key_(mixBits(static_cast<std::uint64_t>(tiles.plane_seed) * kCounterStep + kCounterStep)) {}

  GLINT_HD int size() const { return tiles_.size; }

  /// Number of the tile in cell (i, j), 0 to tile_count - 1.
  GLINT_HD int tileAt(std::int64_t i, std::int64_t j) const {
    const auto x = static_cast<std::uint64_t>(i), y = static_cast<std::uint64_t>(j);
    int first;
    if (tiles_.scheme == WangScheme::edge) {
      const int south = colorOf(x, y, Stream::east), north = colorOf(x, y + 1, Stream::east);
      const int west = colorOf(x, y, Stream::north), east = colorOf(x + 1, y, Stream::north);
      first = tiles_.firstTile(south, north, west, east);
    } else {
      first = tiles_.firstTile(colorOf(x, y, Stream::east), colorOf(x + 1, y, Stream::east), colorOf(x, y + 1, Stream::east),
                               colorOf(x + 1, y + 1, Stream::east));
    }
    return first + (tiles_.variants() > 1 ? below(tiles_.variants(), hash(x, y, Stream::variant)) : 0);
  }

  /// The cell of a position in texels. Positions have the digits of doubles: 1e-3 of a texel at 2^43 texels from the origin. What
  /// is not finite, or beyond 2^62 texels, becomes 0.
  GLINT_HD WangPlace placeOf(double texel_x, double texel_y) const {
    WangPlace place;
    split(texel_x, place.cell_x, place.x);
    split(texel_y, place.cell_y, place.y);
    return place;
  }
  /// A position in its cell as the centre of a footprint, in tiles.
  GLINT_HD Vec2 positionIn(const WangPlace& place) const {
    const float per_tile = 1 / static_cast<float>(tiles_.size);
    return {place.x * per_tile, place.y * per_tile};
  }

 private:
  /// Independent numbers of one vertex: the colour of the edge to the east, or of the corner; of the edge to the north; and the
  /// variant of the cell.
  enum class Stream : std::uint64_t { east = 0, north = 1, variant = 2 };

  static constexpr std::uint64_t kStepY = 0xd1342543de82ef95u;

  GLINT_HD std::uint64_t hash(std::uint64_t x, std::uint64_t y, Stream stream) const {
    return mixBits(mixBits(key_ + kCounterStep * x) + kStepY * y + static_cast<std::uint64_t>(stream));
  }
  /// One of `count` numbers, from the upper 32 bits of a hash.
  static GLINT_HD int below(int count, std::uint64_t bits) {
    return static_cast<int>((bits >> 32) * static_cast<std::uint64_t>(count) >> 32);
  }
  GLINT_HD int colorOf(std::uint64_t x, std::uint64_t y, Stream stream) const {
    return below(stream == Stream::north ? tiles_.colors_v : tiles_.colors_h, hash(x, y, stream));
  }
  GLINT_HD void split(double texels, std::int64_t& cell, float& rest) const {
    constexpr double kFarthest = 4611686018427387904.0;  // 2^62
    if (!(texels > -kFarthest && texels < kFarthest)) return;
    const double width = tiles_.size, number = std::floor(texels / width);
    cell = static_cast<std::int64_t>(number);
    const double left = texels - number * width;  // the quotient may have been rounded up
    rest = left > 0 ? static_cast<float>(left) : 0.0f;
  }

  WangTiles tiles_;
  std::uint64_t key_;
};

}  // namespace glint
