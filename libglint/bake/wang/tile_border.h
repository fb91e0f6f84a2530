#pragma once

#include <cstddef>
#include <cstdint>
#include <vector>

#include "glint/bake/wang/patches.h"
#include "glint/bake/wang/seam_cut.h"
#include "glint/model/wang_tiles.h"

namespace glint::bake {

/// Differences along seams that were cut.
struct SeamSum {
  double difference = 0;  ///< sum over pairs of texels that a seam separates, of the mean difference of the two images
  std::size_t pairs = 0;

  void add(const SeamSum& other) { difference += other.difference, pairs += other.pairs; }
};

/// Adds the differences along the seams of a problem's solution.
void addSeams(const SeamProblem& problem, const std::vector<SeamSide>& sides, SeamSum& sum);

/// The patches of the colours of a set of tiles, and the borders of tiles that they make. Coordinates of a patch are relative to what
/// it is the patch of: the middle of a vertex (scheme corner), or the lower left end of an edge (scheme edge).
///
/// Each border is as deep as the overlap. Its outermost texels depend on the colours of the side alone, and those on both sides of
/// an edge come from the same patches: so tiles agree where they meet.
class TileBorders {
 public:
  /// Sizes of the patches of a scheme: one for each colour of corners, or of horizontal and then of vertical edges.
  struct PatchSize {
    int width, height;
  };
  static int patchCount(const WangTiles& shape) {
    return shape.scheme == WangScheme::corner ? shape.colors_h : shape.colors_h + shape.colors_v;
  }
  static PatchSize patchSize(const WangTiles& shape, int overlap, int patch);

  /// @param patches  of patchSize, in their order
  TileBorders(const WangTiles& shape, int overlap, std::vector<Patch> patches);

  /// Composes the border of a tile.
  /// @param tile   [size][size]: texels within the overlap of the border are written
  /// @param seams  the differences along the seams inside the border are added
  void compose(const WangColors& colors, Patch& tile, SeamSum& seams) const;

  /// How badly the first `count` patches fit each other: mean difference of normals at the best places of their seams.
  static double misfit(const WangTiles& shape, int overlap, const std::vector<Patch>& patches);

 private:
  /// A patch as one tile sees it: texel (x, y) of the tile is texel (x + dx, y + dy) of the patch.
  struct Seen {
    const Patch* patch;
    int dx, dy;
    const Vec2& at(int x, int y) const { return patch->at(x + dx, y + dy); }
  };
  /// A rectangle of a tile where two patches meet.
  struct Meeting {
    int x, y, width, height;
  };

  Seen corner(int color, int right, int up) const;
  Seen edge(int side, int color) const;
  void composeCorners(const WangColors& colors, Patch& tile, SeamSum& seams) const;
  void composeEdges(const WangColors& colors, Patch& tile, SeamSum& seams) const;
  void fill(const Seen& from, const Meeting& area, Patch& tile) const;
  template <class Side>
  void meet(const Seen& first, const Seen& second, const Meeting& area, Side&& side, Patch& tile, SeamSum& seams) const;
  static int bestPlace(const WangTiles& shape, int overlap, const Patch& first, const Patch& second, bool vertical,
                       double* least = nullptr);
  /// Where, along an edge, the patch of its first corner gives way to that of its second.
  int place(int first, int second, bool vertical) const {
    return places_[vertical ? 1 : 0][rowMajorIndex(second, first, shape_.colors_h)];
  }

  WangTiles shape_;
  int overlap_;
  std::vector<Patch> patches_;
  std::vector<int> places_[2];  // scheme corner: [colour of the first corner][of the second], of horizontal and vertical edges
};

}  // namespace glint::bake
