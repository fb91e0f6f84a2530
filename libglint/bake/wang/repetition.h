#pragma once

#include "glint/bake/wang/patches.h"
#include "glint/model/wang_tiles.h"

namespace glint::bake {

/// Tiles along each axis over which repetition is looked for.
inline constexpr int kRepetitionReach = 4;

/// Largest autocorrelation of the normals of the plane at distances of whole tiles, up to kRepetitionReach along each axis: how far
/// the plane resembles itself moved by some tiles. 1: the same tile everywhere; near 0: tiles that have nothing in common. Measured
/// over 4096 cells, from at most 4096 texels of each tile. 0 if all normals are equal.
double planeRepetition(const WangTiles& tiles);

/// The same of a map, at those of these distances over which half of it overlaps itself, or all of it on a map that wraps; 0 if
/// there are none. It is large where the map itself has a pattern that fits the tiles.
/// @param size  of a tile, texels
double mapRepetition(const PatchSource& map, int size);

}  // namespace glint::bake
