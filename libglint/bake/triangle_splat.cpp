#include "glint/bake/triangle_splat.h"

#include <algorithm>
#include <cmath>

namespace glint::bake {
namespace {

constexpr int kTile = BlockBins::kTile;
/// Longest piece, in bins: closer splats do not make the density visibly flatter (0.6 % ripple before the roughness blur).
constexpr float kPiece = 0.9f;

using Float4 = float __attribute__((vector_size(16), may_alias));

}  // namespace

TriangleSplatter::TriangleSplatter(int bins_per_axis)
    : bins_per_axis_(bins_per_axis), tiles_(bins_per_axis / kTile + 2), pitch_(tiles_ * kTile) {
  bins_.assign(static_cast<std::size_t>(pitch_) * pitch_ * 4, 0.0f);
  touched_.assign(static_cast<std::size_t>(tiles_) * tiles_, 0);
}

inline void TriangleSplatter::addPoint(float x, float y, float share, const float weights[4]) {
  const int ix = static_cast<int>(x), iy = static_cast<int>(y);
  const float fx = x - static_cast<float>(ix), fy = y - static_cast<float>(iy), rx = 1 - fx, ry = 1 - fy;
  const float wx[3] = {0.5f * rx * rx, 0.5f + fx * rx, 0.5f * fx * fx};
  const float wy[3] = {0.5f * ry * ry * share, (0.5f + fy * ry) * share, 0.5f * fy * fy * share};
  const Float4 corners = {weights[0], weights[1], weights[2], weights[3]};
  for (int dy = 0; dy < 3; ++dy) {
    auto* row = reinterpret_cast<Float4*>(bins_.data() + (static_cast<std::size_t>(iy - 1 + dy) * pitch_ + ix - 1) * 4);
    const Float4 scaled = corners * wy[dy];
    for (int dx = 0; dx < 3; ++dx) row[dx] += scaled * wx[dx];
  }
  for (const int ty : {(iy - 1) / kTile, (iy + 1) / kTile}) {
    for (const int tx : {(ix - 1) / kTile, (ix + 1) / kTile}) {
      std::uint8_t& touched = touched_[ty * tiles_ + tx];
      if (touched) continue;
      touched = 1;
      touched_tiles_.push_back(ty * tiles_ + tx);
    }
  }
}

void TriangleSplatter::add(Vec2 a, Vec2 b, Vec2 c, const float weights[4]) {
  const float half = 0.5f * static_cast<float>(bins_per_axis_);
  const auto toBins = [&](Vec2 n) { return Vec2{(n.x + 1) * half + kTile, (n.y + 1) * half + kTile}; };
  Vec2 p[3] = {toBins(a), toBins(b), toBins(c)};
  const auto squared = [](Vec2 e) { return dot(e, e); };
  const float e0 = squared(p[1] - p[0]), e1 = squared(p[2] - p[1]), e2 = squared(p[0] - p[2]);
  const float longest = std::max({e0, e1, e2});
  if (longest < kPiece * kPiece) {
    const Vec2 middle = (1.0f / 3) * (p[0] + p[1] + p[2]);
    return addPoint(middle.x, middle.y, 1, weights);
  }
  if (longest == e1) std::rotate(p, p + 1, p + 3);
  else if (longest == e2) std::rotate(p, p + 2, p + 3);
  const Vec2 base = p[1] - p[0], side = p[2] - p[0];
  const float length = std::sqrt(longest);
  const float apex = std::clamp(dot(side, base) / longest, 0.0f, 1.0f);  // where the third corner stands on the base
  const Vec2 rise = side - apex * base;                                  // from the base to the third corner
  const float height = std::sqrt(dot(rise, rise));
  const auto heightAt = [&](float t) { return t < apex ? t / apex : t < 1 ? (1 - t) / (1 - apex) : 0; };
  const auto massBelow = [&](float t) { return t < apex ? t * t / apex : apex < 1 ? 1 - (1 - t) * (1 - t) / (1 - apex) : 1; };

  const int columns = static_cast<int>(std::ceil(length / kPiece));
  const float width = 1 / static_cast<float>(columns);
  float mass_before = 0;
  for (int m = 0; m < columns; ++m) {
    const float t = (static_cast<float>(m) + 0.5f) * width;
    const float mass_after = m + 1 < columns ? massBelow(t + 0.5f * width) : 1;
    const float relative_height = heightAt(t);
    const int pieces = std::max(1, static_cast<int>(std::ceil(relative_height * height / kPiece)));
    const float share = (mass_after - mass_before) / static_cast<float>(pieces);
    const float step = relative_height / static_cast<float>(pieces);
    mass_before = mass_after;
    for (int k = 0; k < pieces; ++k) {
      const Vec2 q = p[0] + t * base + ((static_cast<float>(k) + 0.5f) * step) * rise;
      addPoint(q.x, q.y, share, weights);
    }
  }
}

void TriangleSplatter::extract(BlockBins out[4]) {
  for (const std::int32_t tile : touched_tiles_) {
    float values[4][BlockBins::kTileBins];
    const std::size_t corner = (static_cast<std::size_t>(tile / tiles_) * kTile * pitch_ + static_cast<std::size_t>(tile % tiles_) * kTile) * 4;
    for (int y = 0; y < kTile; ++y) {
      float* row = bins_.data() + corner + static_cast<std::size_t>(y) * pitch_ * 4;
      for (int x = 0; x < kTile; ++x)
        for (int k = 0; k < 4; ++k) values[k][y * kTile + x] = row[4 * x + k];
      std::fill_n(row, 4 * kTile, 0.0f);
    }
    for (int k = 0; k < 4; ++k) out[k].add(tile, values[k], 1);
    touched_[tile] = 0;
  }
  touched_tiles_.clear();
}

}  // namespace glint::bake
