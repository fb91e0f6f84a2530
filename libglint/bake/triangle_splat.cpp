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

using Float4 = float __attribute__((vector_size(16), may_alias));

}  // namespace

TriangleSplatter::TriangleSplatter(int bins_per_axis, float sigma_bins)
    : half_(0.5f * static_cast<float>(bins_per_axis)),
      piece_(kPiecePerSigma * sigma_bins),
      tiles_(bins_per_axis / kTile + 2),
      pitch_(tiles_ * kTile) {
  bins_.assign(static_cast<std::size_t>(pitch_) * pitch_ * 4, 0.0f);
  touched_.assign(static_cast<std::size_t>(tiles_) * tiles_, 0);
}

inline void TriangleSplatter::splatPoint(Vec2 point, float share, const float weights[4], const Raster& raster) {
  const Float4 corners = {weights[0], weights[1], weights[2], weights[3]};
  const int ix = static_cast<int>(point.x), iy = static_cast<int>(point.y);
  const float x = point.x - static_cast<float>(ix), y = point.y - static_cast<float>(iy), rx = 1 - x, ry = 1 - y;
  const float wx[3] = {0.5f * rx * rx, 0.5f + x * rx, 0.5f * x * x};
  const float wy[3] = {0.5f * ry * ry * share, (0.5f + y * ry) * share, 0.5f * y * y * share};
  for (int dy = 0; dy < 3; ++dy) {
    auto* row = reinterpret_cast<Float4*>(raster.bins + (static_cast<std::size_t>(iy - 1 + dy) * raster.pitch + ix - 1) * 4);
    const Float4 scaled = corners * wy[dy];
    for (int dx = 0; dx < 3; ++dx) row[dx] += scaled * wx[dx];
  }
  const int left = (ix - 1) / kTile, right = (ix + 1) / kTile;
  std::uint8_t* lower = raster.touched + (iy - 1) / kTile * raster.tiles;
  std::uint8_t* upper = raster.touched + (iy + 1) / kTile * raster.tiles;
  lower[left] = lower[right] = upper[left] = upper[right] = 1;
}

GLINT_MULTIVERSION void TriangleSplatter::add(Vec2 a, Vec2 b, Vec2 c, const float weights[4]) {
  const Raster raster = {bins_.data(), touched_.data(), pitch_, tiles_};
  const auto toBins = [&](Vec2 n) { return Vec2{(n.x + 1) * half_ + kTile, (n.y + 1) * half_ + kTile}; };
  Vec2 p[3] = {toBins(a), toBins(b), toBins(c)};
  const auto squared = [](Vec2 e) { return dot(e, e); };
  const float e0 = squared(p[1] - p[0]), e1 = squared(p[2] - p[1]), e2 = squared(p[0] - p[2]);
  const float longest = std::max({e0, e1, e2});
  if (4 * longest < piece_ * piece_) {
    const Vec2 middle = (1.0f / 3) * (p[0] + p[1] + p[2]);
    return splatPoint(middle, 1, weights, raster);
  }
  if (longest == e1)
    std::rotate(p, p + 1, p + 3);
  else if (longest == e2)
    std::rotate(p, p + 2, p + 3);
  const Vec2 base = p[1] - p[0], side = p[2] - p[0];
  const float apex = std::clamp(dot(side, base) / longest, 0.0f, 1.0f);  // where the third corner stands on the base
  const Vec2 rise = side - apex * base;                                  // from the base to the third corner
  const float height = std::sqrt(dot(rise, rise));
  const auto heightAt = [&](float t) { return t < apex ? t / apex : t < 1 ? (1 - t) / (1 - apex) : 0; };
  const auto massBelow = [&](float t) { return t < apex ? t * t / apex : apex < 1 ? 1 - (1 - t) * (1 - t) / (1 - apex) : 1; };

  // Columns at their middles spread less than the triangle, by 1 / columns^2 of a uniform density's spread.
  const float length = std::sqrt(longest);
  const float piece = std::clamp(kPiecePerLength * length, piece_, 2 * piece_);
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

CornerBins TriangleSplatter::extract() {
  CornerBins out;
  for (auto tile = touched_.begin(); (tile = std::find(tile, touched_.end(), 1)) != touched_.end(); ++tile)
    out.tiles.push_back(static_cast<std::int32_t>(tile - touched_.begin()));
  out.values.resize(out.tiles.size() * 4 * BlockBins::kTileBins);
  float* values = out.values.data();
  for (const std::int32_t tile : out.tiles) {
    const std::size_t corner =
        (static_cast<std::size_t>(tile / tiles_) * kTile * pitch_ + static_cast<std::size_t>(tile % tiles_) * kTile) * 4;
    for (int y = 0; y < kTile; ++y) {
      float* row = bins_.data() + corner + static_cast<std::size_t>(y) * pitch_ * 4;
      for (int k = 0; k < 4; ++k)
        for (int x = 0; x < kTile; ++x) values[k * BlockBins::kTileBins + y * kTile + x] = row[4 * x + k];
      std::fill_n(row, 4 * kTile, 0.0f);
    }
    values += 4 * BlockBins::kTileBins;
    touched_[tile] = 0;
  }
  return out;
}

}  // namespace glint::bake
