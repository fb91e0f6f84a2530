#include "glint/bake/displace/height_tracer.h"

#include <algorithm>
#include <cmath>
#include <limits>

namespace glint::bake {

namespace {
constexpr float kNever = std::numeric_limits<float>::infinity();
/// A ray that has crossed so many periods of the map counts as escaped, as a level ray that meets nothing must.
constexpr int kMaxWraps = 256;
}  // namespace

/// A ray inside one period of the map. The point at t is origin + t * direction.
struct HeightTracer::Ray {
  Vec3 origin;
  Vec3 direction;
  float heightAt(float t) const { return origin.z + t * direction.z; }

  /// If cell (i, j) is outside the map, moves the ray and the cell into the map by a period, so that coordinates stay small.
  /// @return whether the cell was outside
  bool wrap(Vec3 exit, int width, int height, int& i, int& j) {
    if (i >= 0 && i < width && j >= 0 && j < height) return false;
    origin = exit;
    origin.x += static_cast<float>(i < 0 ? width : i >= width ? -width : 0);
    origin.y += static_cast<float>(j < 0 ? height : j >= height ? -height : 0);
    i = i < 0 ? width - 1 : i >= width ? 0 : i;
    j = j < 0 ? height - 1 : j >= height ? 0 : j;
    return true;
  }
};

HeightTracer::HeightTracer(const HeightSurface& surface) : surface_(surface) {
  Level cells{surface.width(), surface.height(), {}};
  cells.highest.reserve(surface.cellCount());
  for (std::size_t k = 0; k < surface.cellCount(); ++k) {
    const auto c = surface.corners(k);
    cells.highest.push_back(std::max({c.h00, c.h10, c.h01, c.h11}));
  }
  levels_.push_back(std::move(cells));
  while (levels_.back().columns > 1 || levels_.back().rows > 1) {
    const Level& fine = levels_.back();
    Level coarse{(fine.columns + 1) / 2, (fine.rows + 1) / 2, {}};
    for (int j = 0; j < coarse.rows; ++j) {
      for (int i = 0; i < coarse.columns; ++i) {
        const auto at = [&](int x, int y) {
          return fine
              .highest[static_cast<std::size_t>(std::min(y, fine.rows - 1)) * fine.columns + std::min(x, fine.columns - 1)];
        };
        coarse.highest.push_back(
            std::max({at(2 * i, 2 * j), at(2 * i + 1, 2 * j), at(2 * i, 2 * j + 1), at(2 * i + 1, 2 * j + 1)}));
      }
    }
    levels_.push_back(std::move(coarse));
  }
}

/// Finds where the ray falls below one of the two facets of a cell, between t_in and t_out. The ray meets a facet if it is
/// below the facet where it leaves, so that rounding at edges lets no ray through.
/// @return kNever if the ray meets neither facet
float HeightTracer::hitCell(const Ray& ray, int i, int j, float t_in, float t_out, std::size_t& facet) const {
  const std::size_t cell = static_cast<std::size_t>(j) * surface_.width() + i;
  const auto c = surface_.corners(cell);
  const float u = ray.origin.x - static_cast<float>(i), v = ray.origin.y - static_cast<float>(j);
  const float across = ray.direction.x + ray.direction.y;
  const float t_diagonal = across != 0 ? (1 - u - v) / across : kNever;
  const bool only_lower = u + v + 0.5f * (t_in + t_out) * across < 1;
  const bool crosses = t_diagonal > t_in && t_diagonal < t_out;
  for (int part = 0; part < (crosses ? 2 : 1); ++part) {
    const bool lower = crosses ? (part == 0) == (across > 0) : only_lower;
    const float from = part == 0 ? t_in : t_diagonal, to = crosses && part == 0 ? t_diagonal : t_out;
    const Vec2 slope = lower ? Vec2{c.h10 - c.h00, c.h01 - c.h00} : Vec2{c.h11 - c.h01, c.h11 - c.h10};
    const float base = lower ? c.h00 : c.h10 + c.h01 - c.h11;  // height of the facet's plane over vertex (i, j)
    const float fall = ray.direction.z - slope.x * ray.direction.x - slope.y * ray.direction.y;
    const float above = ray.origin.z - base - slope.x * u - slope.y * v;
    if (fall >= 0 || above + to * fall >= 0) continue;
    facet = 2 * cell + (lower ? 0 : 1);
    return std::clamp(-above / fall, from, to);
  }
  return kNever;
}

std::optional<SurfaceHit> HeightTracer::trace(std::size_t facet, Vec3 origin, Vec3 direction) const {
  Ray ray{origin, direction};
  const float inverse_x = 1 / direction.x, inverse_y = 1 / direction.y;
  const int width = surface_.width(), height = surface_.height();
  const float top = levels_.back().highest[0];
  const float horizontal = std::sqrt(direction.x * direction.x + direction.y * direction.y);
  int i = static_cast<int>((facet / 2) % static_cast<std::size_t>(width)),
      j = static_cast<int>((facet / 2) / static_cast<std::size_t>(width));
  float t = 0, travelled = 0;
  int level = 0;
  for (int wraps = 0; wraps < kMaxWraps;) {
    if (direction.z >= 0 && ray.heightAt(t) > top) return std::nullopt;
    // The square of this level that holds cell (i, j), cut off at the border of the map, and where the ray leaves it.
    const int x0 = (i >> level) << level, y0 = (j >> level) << level;
    const int x1 = std::min(x0 + (1 << level), width), y1 = std::min(y0 + (1 << level), height);
    const float tx = direction.x != 0 ? (static_cast<float>(direction.x > 0 ? x1 : x0) - ray.origin.x) * inverse_x : kNever;
    const float ty = direction.y != 0 ? (static_cast<float>(direction.y > 0 ? y1 : y0) - ray.origin.y) * inverse_y : kNever;
    const float t_out = std::max(t, std::min(tx, ty));
    const Level& block = levels_[static_cast<std::size_t>(level)];
    const float highest = block.highest[static_cast<std::size_t>(j >> level) * block.columns + (i >> level)];
    // A vertical ray never leaves its square, and goes up since it starts on the upper side of a facet.
    if (t_out == kNever) return std::nullopt;
    // If the ray is low enough to meet the square, look at smaller squares, and at last at facets.
    if (std::min(ray.heightAt(t), ray.heightAt(t_out)) <= highest) {
      if (level > 0) {
        --level;
        continue;
      }
      std::size_t hit = 0;
      const float t_hit = hitCell(ray, i, j, t, t_out, hit);
      if (t_hit != kNever) {
        const Vec3 point = ray.origin + t_hit * direction;
        return SurfaceHit{hit, point, travelled + t_hit * horizontal};
      }
    }
    // Go on to the next square, and look at larger squares again.
    const Vec3 exit = ray.origin + t_out * direction;
    if (tx <= ty) {
      i = direction.x > 0 ? x1 : x0 - 1;
      j = std::clamp(static_cast<int>(std::floor(exit.y)), y0, y1 - 1);
    } else {
      j = direction.y > 0 ? y1 : y0 - 1;
      i = std::clamp(static_cast<int>(std::floor(exit.x)), x0, x1 - 1);
    }
    t = t_out;
    if (ray.wrap(exit, width, height, i, j)) {
      travelled += t * horizontal;
      t = 0;
      ++wraps;
    }
    if (level + 1 < static_cast<int>(levels_.size())) ++level;
  }
  return std::nullopt;
}

}  // namespace glint::bake
