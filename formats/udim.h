#pragma once

#include <array>
#include <filesystem>
#include <string>
#include <vector>

#include "glint/math/device.h"  // asks for C++20

namespace glint::formats {

/// The feature that a file of a tile requires: readers that do not know it would take the margins for a part of the tile.
inline constexpr const char* kUdimFeature = "udim";

/// Numbers of tiles: 1001 + column + 10 row, with columns 0 to 9.
inline constexpr int kFirstUdim = 1001, kLastUdim = 9999, kUdimColumns = 10;

/// What an asset of a UDIM set covers: one tile, and texels of the neighbouring tiles around it.
struct UdimPlace {
  int tile = kFirstUdim;
  /// Texels beyond the left, lower, right and upper border of the tile. 0 where there is no neighbour.
  std::array<int, 4> margins = {};

  int column() const { return (tile - kFirstUdim) % kUdimColumns; }
  int row() const { return (tile - kFirstUdim) / kUdimColumns; }
  /// Texels of the tile along each axis, of those of the asset.
  int tileWidth(int width) const { return width - margins[0] - margins[2]; }
  int tileHeight(int height) const { return height - margins[1] - margins[3]; }
  friend bool operator==(const UdimPlace&, const UdimPlace&) = default;
};

/// Whether a path names the files of a UDIM set: it holds `<UDIM>`, as in MaterialX and Mari, `<udim>`, as in Arnold, or `%(UDIM)d`, as in
/// Houdini.
bool isUdimPattern(const std::filesystem::path& path);

/// The file of one tile: the token is replaced by the number.
std::filesystem::path udimFile(const std::filesystem::path& pattern, int tile);

/// The tiles of a set that have a file, ascending.
/// @throws Error usage: no token in the name of the file, or more than one; io: the folder cannot be read, or holds no file of the set
std::vector<int> udimTiles(const std::filesystem::path& pattern);

/// Names of files that have another number than that of a tile in the place of the token, such as name.0999.exr or name.10011.exr,
/// ascending. Nothing reads them.
/// @throws Error as udimTiles
std::vector<std::string> udimStrays(const std::filesystem::path& pattern);

/// Refuses a pattern whose token is not in the name of the file, or that has more than one.
/// @throws Error usage
void checkUdimPattern(const std::filesystem::path& pattern);

}  // namespace glint::formats
