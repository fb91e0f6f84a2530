#include "glint/bake/wang/patches.h"

#include <algorithm>
#include <cstddef>

#include "glint/bake/common/counter_random.h"
#include "glint/bake/wang/seam_cut.h"

namespace glint::bake {
namespace {

/// Sides of the texels of a block that is laid over what lies to the left of it and below. The outermost row and column of the overlap
/// keep what lies there, texels beyond the overlap take the block.
std::vector<SeamSide> blockSides(int width, int height, int left, int below) {
  std::vector<SeamSide> sides(rowMajorIndex(0, height, width), SeamSide::second);
  for (int y = 0; y < height; ++y)
    for (int x = 0; x < width; ++x) {
      const bool in_left = x < left, in_below = y < below;
      if (!in_left && !in_below) continue;
      const bool outermost = (left > 0 && x == 0) || (below > 0 && y == 0);
      sides[rowMajorIndex(x, y, width)] = outermost ? SeamSide::first : SeamSide::free;
    }
  return sides;
}

/// Lays a block over the canvas at (x, y).
void layBlock(const Patch& block, int x, int y, int left, int below, Patch& canvas) {
  const std::vector<SeamSide> given = blockSides(block.width, block.height, left, below);
  Patch covered{block.width, block.height, {}};
  covered.normals.reserve(block.normals.size());
  for (int j = 0; j < block.height; ++j)
    for (int i = 0; i < block.width; ++i)
      covered.normals.push_back(i < left || j < below ? canvas.at(x + i, y + j) : block.at(i, j));
  const std::vector<SeamSide> sides = cutSeam({block.width, block.height, covered.normals, block.normals, given});
  for (int j = 0; j < block.height; ++j)
    for (int i = 0; i < block.width; ++i)
      if (sides[rowMajorIndex(i, j, block.width)] == SeamSide::second) canvas.at(x + i, y + j) = block.at(i, j);
}

/// Sum of squared differences over the overlap of a block at (x, y).
double overlapDifference(const PatchSource& source, PatchPlace from, int width, int height, int x, int y, int left, int below,
                         const Patch& canvas) {
  double sum = 0;
  for (int j = 0; j < height; ++j)
    for (int i = 0; i < (j < below ? width : left); ++i) {
      const Vec2 d = source.at(from.x + i, from.y + j) - canvas.at(x + i, y + j);
      sum += double{dot(d, d)};
    }
  return sum;
}

}  // namespace

PatchPlace PatchSource::allowed(int x, int y, int width, int height) const {
  if (boundary_ == Boundary::wrap) return {wrapped(x, width_), wrapped(y, height_)};
  return {std::clamp(x, 0, lastPlace(width_, width)), std::clamp(y, 0, lastPlace(height_, height))};
}

Patch PatchSource::cut(PatchPlace place, int width, int height) const {
  Patch patch{width, height, {}};
  patch.normals.reserve(rowMajorIndex(0, height, width));
  for (int j = 0; j < height; ++j)
    for (int i = 0; i < width; ++i) patch.normals.push_back(at(place.x + i, place.y + j));
  return patch;
}

PatchPlace randomPlace(const PatchSource& source, int width, int height, std::uint64_t seed, WangStream stream,
                       std::uint64_t index) {
  const std::uint64_t bits = randomBits(seed, static_cast<std::uint64_t>(stream), index);
  const auto below = [](std::uint64_t part, int count) {
    return static_cast<int>(part * static_cast<std::uint64_t>(count) >> 32);
  };
  return {below(bits >> 32, source.lastPlace(source.width(), width) + 1),
          below(bits & 0xffffffffu, source.lastPlace(source.height(), height) + 1)};
}

Patch quiltedMap(const PatchSource& source, int width, int height, std::uint64_t seed) {
  // Blocks of three quarters of the map can still begin in different places; along an axis that is large enough, they need not.
  const auto blockSize = [](int map, int wanted) { return std::min(wanted, std::max(map * 3 / 4, 4)); };
  const int block_w = blockSize(source.width(), width), block_h = blockSize(source.height(), height);
  const int overlap_x = std::max(block_w / 4, 2), overlap_y = std::max(block_h / 4, 2);
  const int step_x = block_w - overlap_x, step_y = block_h - overlap_y;
  const auto blocks = [](int wanted, int block, int step) { return 1 + std::max(0, wanted - block + step - 1) / step; };
  const int columns = blocks(width, block_w, step_x), rows = blocks(height, block_h, step_y);
  Patch canvas{(columns - 1) * step_x + block_w, (rows - 1) * step_y + block_h, {}};
  canvas.normals.resize(rowMajorIndex(0, canvas.height, canvas.width));
  constexpr int kCandidates = 8;
  for (int row = 0; row < rows; ++row)
    for (int column = 0; column < columns; ++column) {
      const int x = column * step_x, y = row * step_y, left = column > 0 ? overlap_x : 0, below = row > 0 ? overlap_y : 0;
      PatchPlace best;
      double least = 0;
      for (int k = 0; k < kCandidates; ++k) {
        const auto index = static_cast<std::uint64_t>((row * columns + column) * kCandidates + k);
        const PatchPlace from = randomPlace(source, block_w, block_h, seed, WangStream::blocks, index);
        const double difference = overlapDifference(source, from, block_w, block_h, x, y, left, below, canvas);
        if (k == 0 || difference < least) best = from, least = difference;
      }
      layBlock(source.cut(best, block_w, block_h), x, y, left, below, canvas);
    }
  return canvas;
}

}  // namespace glint::bake
