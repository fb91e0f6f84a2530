#include "glint/bake/ingest/near_normals.h"

#include <algorithm>
#include <cmath>
#include <memory_resource>
#include <vector>

#include "glint/bake/ingest/normal_bounds.h"

namespace glint::bake {
namespace {

constexpr float kMostCode = 32767;

std::size_t texelCount(const NearNormals& normals) { return rowMajorIndex(0, normals.height, normals.width); }

/// The smallest power of two up to 2^-15 with which codes reach the largest component.
float stepOf(const NearNormals& normals) {
  float most = 0;
  for (std::size_t k = 0; k < texelCount(normals); ++k) {
    const Vec2 n = normals.normal(k);
    most = std::max({most, std::fabs(n.x), std::fabs(n.y)});
  }
  constexpr float kLeast = 0x1p-40f, kMost = 0x1p-15f;  // of steps
  float step = kLeast;
  while (step < kMost && step * kMostCode < most) step *= 2;
  return step;
}

/// The nearest code whose normal lies inside the disk; that of a flat facet for what is no number.
NormalCode codeOf(Vec2 n, float step) {
  if (!std::isfinite(n.x) || !std::isfinite(n.y)) return {};
  const auto nearest = [&](float x) { return std::clamp(std::nearbyint(x / step), -kMostCode, kMostCode); };
  Vec2 code = {nearest(n.x), nearest(n.y)};
  while (!(dot(step * code, step * code) < 1)) {
    float& larger = std::fabs(code.x) > std::fabs(code.y) ? code.x : code.y;
    larger -= std::copysign(1.0f, larger);
  }
  return {static_cast<std::int16_t>(code.x), static_cast<std::int16_t>(code.y)};
}

std::int16_t codeOf(float bound, float step) { return static_cast<std::int16_t>(bound / step); }  // exact

}  // namespace

struct NearNormalsData::Arrays {
  std::pmr::vector<Vec2> normals;
  std::vector<NormalBoundsStorage> bounds;
  std::pmr::vector<NormalCode> codes;
  std::vector<std::pmr::vector<CodeBounds>> code_bounds;
};

NearNormalsData keepNormals(const NearNormals& normals, NearType type) {
  NearNormalsData data;
  data.view_ = normals;
  if (normals.type == type && normals.bounds_level_count > 0) return data;
  auto arrays = std::make_shared<NearNormalsData::Arrays>();
  const std::size_t count = texelCount(normals);
  const float step = normals.coded() ? normals.step : type == NearType::i16 ? stepOf(normals) : 1;

  // Normals as queries will see them, and their bounds.
  arrays->normals.resize(count);
  if (type == NearType::i16) arrays->codes.resize(count);
  for (std::size_t k = 0; k < count; ++k) {
    arrays->normals[k] = normals.normal(k);
    if (type != NearType::i16) continue;
    arrays->codes[k] = codeOf(arrays->normals[k], step);
    arrays->normals[k] = step * Vec2{static_cast<float>(arrays->codes[k].x), static_cast<float>(arrays->codes[k].y)};
  }
  arrays->bounds = buildNormalBounds(normals.width, normals.height, arrays->normals);

  NormalMap map;
  map.width = normals.width;
  map.height = normals.height;
  map.normals = arrays->normals;
  attachBounds(map, arrays->bounds);
  data.view_ = map;
  if (type == NearType::i16) {
    data.view_.type = type;
    data.view_.step = step;
    data.view_.texels = arrays->codes.data();
    arrays->code_bounds.resize(static_cast<std::size_t>(map.bounds_level_count));
    for (int l = 0; l < map.bounds_level_count; ++l) {
      std::pmr::vector<CodeBounds>& codes = arrays->code_bounds[static_cast<std::size_t>(l)];
      codes.reserve(map.bounds[l].nodes.size());
      for (const NormalBounds& b : map.bounds[l].nodes)
        codes.push_back({codeOf(b.low_x, step), codeOf(b.low_y, step), codeOf(b.high_x, step), codeOf(b.high_y, step)});
      data.view_.bounds[l].nodes = codes.data();
    }
    arrays->normals = std::pmr::vector<Vec2>();
    arrays->bounds = std::vector<NormalBoundsStorage>();
  }
  data.arrays_ = std::move(arrays);
  return data;
}

double keepNormalsBytes(int width, int height, NearType type) {
  constexpr double kFloats = 8 + 16.0 / 3, kCodes = 4 + 8.0 / 3;  // bytes of a texel, with its share of the bounds
  return (type == NearType::i16 ? kFloats + 2 * kCodes : kFloats) * width * height;
}

std::uint64_t nearBytes(const NearNormals& normals) {
  std::uint64_t bytes = texelCount(normals) * normalBytes(normals.type);
  for (int l = 0; l < normals.bounds_level_count; ++l) bytes += normals.bounds[l].size() * boundsBytes(normals.type);
  return bytes;
}

}  // namespace glint::bake
