#include "glint/bake/pyramid/triangle_splat.h"

#include <algorithm>
#include <cmath>

#include "glint/bake/common/simd.h"
#include "glint/bake/pyramid/triangle_splat_kernels.h"

namespace glint::bake {
namespace {

constexpr int kTile = BlockBins::kTile;
// All lengths below are as large as an error of images of 1 % rel_l2 allows. The test
// Pyramid.SmoothImagesAreTheExactOnesAtTheirCentres holds that bound.

/// Length of the longest piece of a small triangle, in deviations of the blur.
constexpr float kPiecePerSigma = 0.7f;
/// Pieces of a large triangle have a tenth of its length, but at most twice the length of pieces of small triangles.
constexpr float kPiecePerLength = 0.1f;
/// A triangle longer than this many pieces goes to the coarse grid.
constexpr float kLongPieces = 9;
/// A triangle is fat, and drawn by rows, if its height on the longest edge is more than this many pieces, and its extent along
/// y more than twice as many.
constexpr float kFatPieces = 2;
/// Distance of the rows of a fat triangle, in pieces.
constexpr float kRowPieces = 0.6f;

}  // namespace

TriangleSplatter::Raster::Raster(const DirectionTiles::Grid& grid)
    : half(0.5f * static_cast<float>(grid.bins_per_axis)),
      first(grid.first),
      tiles(grid.tilesPerAxis()),
      pitch(tiles * kTile),
      bins(static_cast<std::size_t>(pitch) * pitch * kMoments, 0.0f),
      touched(static_cast<std::size_t>(tiles) * tiles, 0) {}

TriangleSplatter::TriangleSplatter(const DirectionTiles& tiles, float sigma_bins)
    : fine_(tiles.fine), coarse_(tiles.coarse), piece_(kPiecePerSigma * sigma_bins) {}

void TriangleSplatter::add(Vec2 a, Vec2 b, Vec2 c, const float weights[kMoments]) {
  // A triangle much smaller than a piece is a point.
  const auto squared = [&](Vec2 e) { return fine_.half * fine_.half * dot(e, e); };
  const float e0 = squared(b - a), e1 = squared(c - b), e2 = squared(a - c);
  const float longest = std::max({e0, e1, e2});
  if (4 * longest < piece_ * piece_) return splatPoint(fine_.place((1.0f / 3) * (a + b + c)), 1, weights, fine_.view());
  // Choose the grid and the length of pieces.
  const bool is_long = longest > kLongPieces * kLongPieces * piece_ * piece_;
  Raster& raster = is_long ? coarse_ : fine_;
  Vec2 p[3] = {raster.place(a), raster.place(b), raster.place(c)};
  const float length = (is_long ? 0.5f : 1.0f) * std::sqrt(longest);
  const float shortest_piece = is_long ? 0.5f * piece_ : piece_;
  const float piece = std::clamp(kPiecePerLength * length, shortest_piece, 2 * shortest_piece);
  // Draw a fat triangle by rows from bottom to top, and a thin one by columns on its longest edge.
  const Vec2 side = p[1] - p[0], other = p[2] - p[0];
  const auto [low, high] = std::minmax({p[0].y, p[1].y, p[2].y});
  if (std::fabs(side.x * other.y - side.y * other.x) > kFatPieces * piece * length && high - low > 2 * kFatPieces * piece) {
    std::sort(p, p + 3, [](Vec2 s, Vec2 t) { return s.y < t.y; });
    return splatRows(p, kRowPieces * piece, weights, patch_, raster.view());
  }
  if (longest == e1)
    std::rotate(p, p + 1, p + 3);
  else if (longest == e2)
    std::rotate(p, p + 2, p + 3);
  splatColumns(p, piece, weights, raster.view());
}

namespace {

/// Adds a tile of the raster, [row][column][moment], to `to`, [moment][64], and clears the tile.
GLINT_MULTIVERSION void moveTile(float* row, int pitch, float* to) {
  for (int y = 0; y < kTile; ++y, row += static_cast<std::size_t>(pitch) * kMoments, to += kTile) {
    for (int k = 0; k < kMoments; ++k)
      for (int x = 0; x < kTile; ++x) to[k * BlockBins::kTileBins + x] += row[kMoments * x + k];
    std::fill_n(row, kMoments * kTile, 0.0f);
  }
}

}  // namespace

void TriangleSplatter::Raster::moveTo(BlockBins& moments) {
  for (auto flag = touched.begin(); (flag = std::find(flag, touched.end(), 1)) != touched.end(); ++flag) {
    const auto tile = static_cast<int>(flag - touched.begin());
    float* corner = bins.data() + (static_cast<std::size_t>(tile / tiles) * kTile * pitch + tile % tiles * kTile) * kMoments;
    moveTile(corner, pitch, moments.take(first + tile));
    *flag = 0;
  }
}

void TriangleSplatter::moveTo(BlockBins& moments) {
  fine_.moveTo(moments);
  coarse_.moveTo(moments);
}

}  // namespace glint::bake
