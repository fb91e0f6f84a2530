#pragma once

#include <algorithm>
#include <cmath>

#include "glint/model/tiny_example.h"
#include "glint/query/detail/pyramid/pyramid_slices.h"
#include "glint/query/detail/tiny/example_elements.h"
#include "glint/query/detail/tiny/example_owners.h"
#include "glint/query/detail/tiny/gaussian_lattice.h"
#include "glint/query/detail/tiny/moved_covariance.h"
#include "glint/query/detail/tiny/tiny_pieces.h"

namespace glint {

/// What is seen at a point of a plane of scattered examples.
struct SeenPoint {
  bool background = true;  ///< no example covers the point
  NormalTurn turn;
  Vec2 local;  ///< position in the example, texels from its lower left corner
  Matrix2 to_example;
};

/// The pieces of a footprint on a plane of scattered examples.
///
/// A lattice of points of the plane finds the examples that the footprint sees, and the share of the surface between them. Each of
/// these examples weighs its tiles, of about the size of the lattice's squares, or its elements: those whose middle it owns.
class ScatteredPieces {
 public:
  static constexpr double kMostSquares = 64;
  /// From this share of largestSigma() on, the mean of the plane takes over.
  static constexpr float kFadeBegin = 0.7f;

  GLINT_HD explicit ScatteredPieces(const TinyExample& example)
      : cells_(example),
        elements_(example),
        overlap_(example.overlap),
        size_(static_cast<float>(example.size())),
        levels_(example.exampleLevels()),
        sigma_r_(example.images.shape.sigma_r),
        reach_(std::min(example.transforms.reach(), float{TinyExample::kMostReach})),
        largest_sigma_(size_ * TinyExample::sigmaInCells(example.density, reach_)) {}

  /// Deviation, texels, from which on the mean of the plane answers alone.
  GLINT_HD float largestSigma() const { return largest_sigma_; }

  GLINT_HD void collect(const PlanePoint& point, const Covariance& covariance, TinyPieces& pieces) const {
    const UsableCovariance c = positiveCovariance(covariance);
    const auto sigma = static_cast<float>(principalAxes(c).longest);
    pieces.mean = std::clamp((sigma / largest_sigma_ - kFadeBegin) / (1 - kFadeBegin), 0.0f, 1.0f);
    if (!(pieces.mean < 1)) {
      pieces.mean = 1;
      return;
    }
    Squares squares;
    spread(c, point.offset, squares);
    const NearExamples near(cells_, point, size_, reach_, squares.half_x, squares.half_y);
    std::uint8_t owners[kMostPoints];
    near.findOwners(squares.middles, squares.count, size_, overlap_, owners);
    std::uint64_t seen[2] = {};
    float total = 0, background = 0;
    for (int k = 0; k < squares.count; ++k) {
      total += squares.weights[k];
      if (owners[k] == NearExamples::kNone)
        background += squares.weights[k];
      else
        seen[owners[k] >> 6] |= std::uint64_t{1} << (owners[k] & 63);
    }
    pieces.background = (1 - pieces.mean) * background / total;
    for (int word = 0; word < 2; ++word)
      for (std::uint64_t bits = seen[word]; bits != 0; bits &= bits - 1)
        addExample(near, 64 * word + lowestBit(bits), c, point.offset, squares.side, pieces);
    // An example may be seen at a corner only, where it owns no middle of a tile.
    if (pieces.image_count + pieces.lobe_count == 0)
      for (int k = 0; k < squares.count; ++k)
        if (owners[k] != NearExamples::kNone) addPoint(near[owners[k]], squares.middles[k], squares.weights[k], pieces);
    pieces.normalise(1 - pieces.mean - pieces.background);
  }

  /// What is seen at a point.
  GLINT_HD SeenPoint seenAt(const PlanePoint& point) const {
    const NearExamples near(cells_, point, size_, reach_, 0, 0);
    std::uint8_t owner = NearExamples::kNone;
    near.findOwners(&point.offset, 1, size_, overlap_, &owner);
    if (owner == NearExamples::kNone) return {};
    const PlacedExample& placed = near[owner];
    return {false, NormalTurn(placed.matrix, placed.heights), localOf(placed, point.offset), placed.inverse};
  }

 private:
  static constexpr int kMostPoints = NearExamples::kMostPoints;
  static constexpr int kFinestShift = -3;  ///< squares are at least an eighth of a texel wide

  /// Squares and their weights in a footprint.
  struct Squares {
    GLINT_HD Squares() {}
    union {
      Vec2 middles[kMostPoints];  ///< on the plane, texels
    };
    float weights[kMostPoints];
    int count = 0;
    float side = 1;
    float half_x = 0, half_y = 0;  ///< half extent of the box around them, texels
  };

  /// Spreads a footprint over squares of 2^k texels: the smallest of which at most kMostSquares are met. They stay where they are
  /// while the footprint moves.
  GLINT_HD void spread(const UsableCovariance& c, Vec2 centre, Squares& squares) const {
    const auto sideOf = [](int shift) {
      return shift < 0 ? 1 / static_cast<float>(1 << -shift) : static_cast<float>(1 << shift);
    };
    const auto latticeOf = [&](int shift) {
      const double side = sideOf(shift);
      return GaussianLattice(c, side, side * side / 12);
    };
    // Squares may be wider than an example: where examples are few, footprints of many cells are answered from them.
    constexpr int kCoarsestShift = 30;
    int shift = kFinestShift;
    while (shift < kCoarsestShift && latticeOf(shift).squares() > kMostSquares) ++shift;
    const GaussianLattice lattice = latticeOf(shift);
    const float side = squares.side = sideOf(shift);
    squares.half_x = side * static_cast<float>(lattice.extentX());
    squares.half_y = side * static_cast<float>(lattice.extentY());
    lattice.forEach(double{centre.x / side}, double{centre.y / side}, [&](int i, int j, float weight) {
      if (squares.count == kMostPoints) return;
      squares.middles[squares.count] = {(static_cast<float>(i) + 0.5f) * side, (static_cast<float>(j) + 0.5f) * side};
      squares.weights[squares.count++] = weight;
    });
  }

  GLINT_HD Vec2 localOf(const PlacedExample& placed, Vec2 point) const {
    return placed.local(point) + Vec2{0.5f * size_, 0.5f * size_};
  }

  /// Level of the tiles that are about as wide as squares of the plane; -1: elements.
  GLINT_HD int levelFor(const PlacedExample& placed, float side) const {
    constexpr float kSqrt2 = 1.41421356f;
    const float asked = side * std::sqrt(std::fabs(placed.inverse.determinant()));
    return asked < kSqrt2 ? -1 : std::min(static_cast<int>(log2Of(asked) - 0.5f), levels_ - 1);
  }

  /// Adds the tiles or elements of an example that are met and seen.
  GLINT_HD void addExample(const NearExamples& near, int example, const UsableCovariance& c, Vec2 centre, float side,
                           TinyPieces& pieces) const {
    const PlacedExample& placed = near[example];
    const Covariance narrow = {static_cast<float>(c.xx), static_cast<float>(c.xy), static_cast<float>(c.yy)};
    const UsableCovariance moved = movedCovariance(narrow, placed.inverse);
    constexpr double kSeed = kSeedSigma * kSeedSigma;
    const auto latticeOf = [&](int level) {
      const double tile = level < 0 ? 1 : 2 << level;
      return GaussianLattice(moved, tile, level < 0 && elements_.smooth() ? -kSeed : tile * tile / 12);
    };
    int level = levelFor(placed, side);
    while (level + 1 < levels_ && latticeOf(level).squares() > kMostPoints) ++level;
    const GaussianLattice lattice = latticeOf(level);
    const int tile = level < 0 ? 1 : 2 << level, columns = static_cast<int>(size_) / tile;
    const Vec2 at = localOf(placed, centre);
    Squares tiles;
    int numbers[kMostPoints];
    lattice.forEachInside(double{at.x} / tile, double{at.y} / tile, 0, columns - 1, [&](int i, int j, float weight) {
      if (tiles.count == kMostPoints) return;
      const float half = 0.5f * size_, width = static_cast<float>(tile);
      const Vec2 middle = {(static_cast<float>(i) + 0.5f) * width - half, (static_cast<float>(j) + 0.5f) * width - half};
      numbers[tiles.count] = j * columns + i;
      tiles.middles[tiles.count] = placed.centre + placed.matrix * middle;
      tiles.weights[tiles.count++] = weight / lattice.total();
    });
    std::uint8_t owners[kMostPoints];
    near.findOwners(tiles.middles, tiles.count, size_, overlap_, owners);
    const int number = pieces.addExample(NormalTurn(placed.matrix, placed.heights));
    const ElementFootprint share(moved, 1);
    for (int k = 0; k < tiles.count; ++k) {
      if (owners[k] != example) continue;
      if (level >= 0)
        pieces.addImage(number, level, numbers[k], tiles.weights[k]);
      else
        addElement(pieces.turns[number], numbers[k] % columns, numbers[k] / columns, at, tiles.weights[k], share, pieces);
    }
  }

  /// Adds an element.
  /// @param at  centre of the footprint in the example, texels
  GLINT_HD void addElement(const NormalTurn& turn, int i, int j, Vec2 at, float weight, const ElementFootprint& share,
                           TinyPieces& pieces) const {
    const Vec2 n = elements_.normal(i, j);
    if (!elements_.smooth()) return pieces.addLobe(NormalLobe(turn.turned(n), sigma_r_), weight);
    const Vec2 away = {at.x - static_cast<float>(i) - 0.5f, at.y - static_cast<float>(j) - 0.5f};
    pieces.addLobe(share.lobe(turn.turned(n), turn.turned(n, elements_.jacobian(i, j)), away, sigma_r_), weight);
  }

  /// Adds the normal that is seen at a point.
  GLINT_HD void addPoint(const PlacedExample& placed, Vec2 point, float weight, TinyPieces& pieces) const {
    const Vec2 x = localOf(placed, point);
    const Vec2 n = elements_.normal(elements_.texelOf(x.x), elements_.texelOf(x.y));
    pieces.addLobe(NormalLobe(NormalTurn(placed.matrix, placed.heights).turned(n), sigma_r_), weight);
  }

  CellExamples cells_;
  ExampleElements elements_;
  TinyOverlap overlap_;
  float size_;
  int levels_;
  float sigma_r_, reach_, largest_sigma_;
};

}  // namespace glint
