#include "glint/bake/triangle_splat.h"

#include <algorithm>
#include <cmath>

#include "glint/bake/simd.h"

namespace glint::bake {
namespace {

constexpr int kTile = BlockBins::kTile;
/// Longest piece of a small triangle, in deviations of the blur. At 0.8, images of small maps miss the 1 % rel_l2 that tests hold.
constexpr float kPiecePerSigma = 0.7f;
/// Pieces of large triangles are a tenth of their length, up to twice that: 1.4 deviations still sum to a density that is flat to
/// 2 exp(-2 pi^2 / 1.4^2) = 1e-4, and only the border is drawn more coarsely.
constexpr float kPiecePerLength = 0.1f;
/// Triangles longer than this many pieces go to the coarse grid, whose splats alone are good to 1 % of a point's image, and of a
/// long triangle's to a fraction of it.
constexpr float kLongPieces = 9;

using Float8 = float __attribute__((vector_size(32), aligned(4), may_alias));

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

inline void TriangleSplatter::splatPoint(Vec2 point, float share, const float weights[kMoments], Raster& raster) {
  // Cubic B-spline weights of the four bins around the point: bins have their centres at halves.
  const auto splineWeights = [](float x, float scale, float w[4]) {
    const float r = 1 - x;
    w[0] = scale * r * r * r;
    w[1] = scale * (4 - 3 * x * x * (1 + r));
    w[2] = scale * (4 - 3 * r * r * (1 + x));
    w[3] = scale * x * x * x;
  };
  const float x = point.x - 0.5f, y = point.y - 0.5f;
  const int ix = static_cast<int>(x), iy = static_cast<int>(y);
  float wx[4], wy[4];
  splineWeights(x - static_cast<float>(ix), 1.0f / 6, wx);
  splineWeights(y - static_cast<float>(iy), share / 6, wy);
  float across[4 * kMoments];
  for (int k = 0; k < 4 * kMoments; ++k) across[k] = wx[k / kMoments] * weights[k % kMoments];
  const Float8 left = *reinterpret_cast<const Float8*>(across), right = *reinterpret_cast<const Float8*>(across + 8);
  for (int dy = 0; dy < 4; ++dy) {
    auto* row = reinterpret_cast<Float8*>(raster.bins.data() +
                                          (static_cast<std::size_t>(iy - 1 + dy) * raster.pitch + ix - 1) * kMoments);
    row[0] += left * wy[dy];
    row[1] += right * wy[dy];
  }
  const int first = (ix - 1) / kTile, last = (ix + 2) / kTile;
  std::uint8_t* lower = raster.touched.data() + (iy - 1) / kTile * raster.tiles;
  std::uint8_t* upper = raster.touched.data() + (iy + 2) / kTile * raster.tiles;
  lower[first] = lower[last] = upper[first] = upper[last] = 1;
}

GLINT_MULTIVERSION void TriangleSplatter::add(Vec2 a, Vec2 b, Vec2 c, const float weights[kMoments]) {
  const auto squared = [&](Vec2 e) { return fine_.half * fine_.half * dot(e, e); };
  const float e0 = squared(b - a), e1 = squared(c - b), e2 = squared(a - c);
  float longest = std::max({e0, e1, e2});
  if (4 * longest < piece_ * piece_) return splatPoint(fine_.place((1.0f / 3) * (a + b + c)), 1, weights, fine_);
  const bool is_long = longest > kLongPieces * kLongPieces * piece_ * piece_;
  Raster& raster = is_long ? coarse_ : fine_;
  Vec2 p[3] = {raster.place(a), raster.place(b), raster.place(c)};
  if (longest == e1)
    std::rotate(p, p + 1, p + 3);
  else if (longest == e2)
    std::rotate(p, p + 2, p + 3);
  if (is_long) longest *= 0.25f;
  const float shortest_piece = is_long ? 0.5f * piece_ : piece_;
  const Vec2 base = p[1] - p[0], side = p[2] - p[0];
  const float apex = std::clamp(dot(side, base) / longest, 0.0f, 1.0f);  // where the third corner stands on the base
  const Vec2 rise = side - apex * base;                                  // from the base to the third corner
  const float height = std::sqrt(dot(rise, rise));
  const auto heightAt = [&](float t) { return t < apex ? t / apex : t < 1 ? (1 - t) / (1 - apex) : 0; };
  const auto massBelow = [&](float t) { return t < apex ? t * t / apex : apex < 1 ? 1 - (1 - t) * (1 - t) / (1 - apex) : 1; };

  // Columns at their middles spread less than the triangle, by 1 / columns^2 of a uniform density's spread.
  const float length = std::sqrt(longest);
  const float piece = std::clamp(kPiecePerLength * length, shortest_piece, 2 * shortest_piece);
  const int columns = std::max(2, static_cast<int>(length / piece + 1));
  const float width = 1 / static_cast<float>(columns);
  const float centre = (1 + apex) / 3;
  const float variance = (1 - apex + apex * apex) / 18;  // of a triangle along its base
  const float stretch = std::sqrt(variance / (variance - width * width / 12));
  float mass_before = 0;
  for (int m = 0; m < columns; ++m) {
    const float t = (static_cast<float>(m) + 0.5f) * width;
    const float mass_after = m + 1 < columns ? massBelow(t + 0.5f * width) : 1;
    const float relative_height = heightAt(t);
    const int pieces = static_cast<int>(relative_height * height / piece + 1);
    const float share = (mass_after - mass_before) / static_cast<float>(pieces);
    const float step = relative_height / static_cast<float>(pieces);
    mass_before = mass_after;
    const Vec2 foot = p[0] + (centre + stretch * (t - centre)) * base;
    for (int k = 0; k < pieces; ++k) splatPoint(foot + ((static_cast<float>(k) + 0.5f) * step) * rise, share, weights, raster);
  }
}

namespace {

/// Adds a tile of [row][column][moment] to `to`, [moment][64], and clears it.
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
