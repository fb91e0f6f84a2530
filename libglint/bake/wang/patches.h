#pragma once

#include <cstdint>
#include <span>
#include <vector>

#include "glint/model/normal_map.h"

namespace glint::bake {

/// A rectangle of normals.
struct Patch {
  int width = 0;
  int height = 0;
  std::vector<Vec2> normals;  ///< [height][width]

  const Vec2& at(int x, int y) const { return normals[rowMajorIndex(x, y, width)]; }
  Vec2& at(int x, int y) { return normals[rowMajorIndex(x, y, width)]; }
};

/// Lower left corner of a patch in the map that it is cut from.
struct PatchPlace {
  int x = 0;
  int y = 0;
};

/// A map that patches are cut from.
class PatchSource {
 public:
  /// @param normals  [height][width]; must outlive this object
  PatchSource(int width, int height, std::span<const Vec2> normals, Boundary boundary)
      : width_(width), height_(height), normals_(normals), boundary_(boundary) {}

  int width() const { return width_; }
  int height() const { return height_; }
  Boundary boundary() const { return boundary_; }

  /// Whether patches of this size can be cut. A map that wraps gives patches of any size.
  bool holds(int width, int height) const { return boundary_ == Boundary::wrap || (width <= width_ && height <= height_); }
  /// Largest coordinate of the lower left corner of a patch along an axis of `map` texels.
  int lastPlace(int map, int patch) const { return boundary_ == Boundary::wrap ? map - 1 : map - patch; }
  /// A place in the allowed range. Places beyond it are wrapped, or moved to its end.
  PatchPlace allowed(int x, int y, int width, int height) const;

  Vec2 at(int x, int y) const { return normals_[rowMajorIndex(wrapped(x, width_), wrapped(y, height_), width_)]; }
  Patch cut(PatchPlace place, int width, int height) const;

 private:
  static int wrapped(int i, int n) {
    const int rest = i % n;
    return rest < 0 ? rest + n : rest;
  }

  int width_, height_;
  std::span<const Vec2> normals_;
  Boundary boundary_;
};

/// Numbers of streams of random places, so that no two uses draw the same.
enum class WangStream : std::uint64_t { blocks = 1, borders = 2, interiors = 3, plane = 4 };

/// A random place of a patch: place number `index` of a stream.
PatchPlace randomPlace(const PatchSource& source, int width, int height, std::uint64_t seed, WangStream stream,
                       std::uint64_t index);

/// A map at least as large as asked for, made of blocks of a smaller one that overlap by a quarter, each cut to its neighbours along
/// the seam of least difference (Efros and Freeman 2001, with the cut of Kwatra et al. 2003).
Patch quiltedMap(const PatchSource& source, int width, int height, std::uint64_t seed);

}  // namespace glint::bake
