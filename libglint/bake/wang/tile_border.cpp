#include "glint/bake/wang/tile_border.h"

#include <algorithm>
#include <cmath>
#include <utility>

namespace glint::bake {
namespace {

/// Texels that the patch of a corner reaches from its vertex along both axes.
int cornerReach(const WangTiles& shape, int overlap) { return (shape.size + 1) / 2 + overlap; }

}  // namespace

void addSeams(const SeamProblem& problem, const std::vector<SeamSide>& sides, SeamSum& sum) {
  const auto taken = [](SeamSide side) { return side == SeamSide::first || side == SeamSide::second; };
  const auto addPair = [&](std::size_t p, std::size_t q) {
    if (!taken(sides[p]) || !taken(sides[q]) || sides[p] == sides[q]) return;
    sum.difference += 0.5 * double{seamDifference(problem.first[p], problem.second[p], problem.first[q], problem.second[q])};
    ++sum.pairs;
  };
  for (int y = 0; y < problem.height; ++y)
    for (int x = 0; x < problem.width; ++x) {
      const std::size_t k = rowMajorIndex(x, y, problem.width);
      if (x + 1 < problem.width) addPair(k, k + 1);
      if (y + 1 < problem.height) addPair(k, k + static_cast<std::size_t>(problem.width));
    }
}

TileBorders::PatchSize TileBorders::patchSize(const WangTiles& shape, int overlap, int patch) {
  if (shape.scheme == WangScheme::corner) return {2 * cornerReach(shape, overlap), 2 * cornerReach(shape, overlap)};
  if (patch < shape.colors_h) return {shape.size, 2 * overlap};
  return {2 * overlap, shape.size};
}

TileBorders::TileBorders(const WangTiles& shape, int overlap, std::vector<Patch> patches)
    : shape_(shape), overlap_(overlap), patches_(std::move(patches)) {
  if (shape_.scheme != WangScheme::corner) return;
  for (int axis = 0; axis < 2; ++axis)
    for (int first = 0; first < shape_.colors_h; ++first)
      for (int second = 0; second < shape_.colors_h; ++second)
        places_[axis].push_back(bestPlace(shape_, overlap_, patches_[static_cast<std::size_t>(first)],
                                          patches_[static_cast<std::size_t>(second)], axis == 1));
}

/// The texels in the four rows (columns) nearest to the edge decide: two on each side, and the outermost of both tiles among them.
int TileBorders::bestPlace(const WangTiles& shape, int overlap, const Patch& first, const Patch& second, bool vertical,
                           double* least) {
  const int middle = shape.size / 2, origin = cornerReach(shape, overlap);
  const auto differenceAt = [&](int along) {
    double sum = 0;
    for (int across = -2; across < 2; ++across) {
      const int a = origin + along, b = origin + along - shape.size, c = origin + across;
      const auto normal = [&](const Patch& patch, int position) {
        return vertical ? patch.at(c, position) : patch.at(position, c);
      };
      sum += 0.25 * double{seamDifference(normal(first, a - 1), normal(second, b - 1), normal(first, a), normal(second, b))};
    }
    return sum;
  };
  int best = middle;
  double best_difference = differenceAt(middle);
  for (int along = middle - overlap + 2; along < middle + overlap - 1; ++along)
    if (const double difference = differenceAt(along); difference < best_difference) best = along, best_difference = difference;
  if (least != nullptr) *least = 0.5 * best_difference;
  return best;
}

double TileBorders::misfit(const WangTiles& shape, int overlap, const std::vector<Patch>& patches) {
  double sum = 0;
  std::size_t count = 0;
  if (shape.scheme == WangScheme::corner) {
    for (const Patch& first : patches)
      for (const Patch& second : patches)
        for (const bool vertical : {false, true}) {
          double least = 0;
          bestPlace(shape, overlap, first, second, vertical, &least);
          sum += least, ++count;
        }
    return sum / static_cast<double>(count);
  }
  // Horizontal and vertical edges meet at the four corners of a tile, near the diagonals.
  const auto horizontal = static_cast<std::size_t>(shape.colors_h);
  for (std::size_t h = 0; h < std::min(horizontal, patches.size()); ++h)
    for (std::size_t v = horizontal; v < patches.size(); ++v)
      for (int k = 0; k < 4 * overlap; ++k) {
        const int depth = k / 4, far = shape.size - 1 - depth;
        const int x = k & 1 ? far : depth, y = k & 2 ? far : depth;  // texel of the tile
        const Vec2 a = patches[h].at(x, k & 2 ? overlap - 1 - depth : overlap + depth);
        const Vec2 d = a - patches[v].at(k & 1 ? overlap - 1 - depth : overlap + depth, y);
        sum += double{std::sqrt(dot(d, d))}, ++count;
      }
  return count > 0 ? sum / static_cast<double>(count) : 0;
}

void TileBorders::compose(const WangColors& colors, Patch& tile, SeamSum& seams) const {
  if (shape_.scheme == WangScheme::corner)
    composeCorners(colors, tile, seams);
  else
    composeEdges(colors, tile, seams);
}

TileBorders::Seen TileBorders::corner(int color, int right, int up) const {
  const int origin = cornerReach(shape_, overlap_);
  return {&patches_[static_cast<std::size_t>(color)], origin - right * shape_.size, origin - up * shape_.size};
}

/// Side 0 to 3: south, north, west, east.
TileBorders::Seen TileBorders::edge(int side, int color) const {
  const int away = side % 2 == 0 ? overlap_ : overlap_ - shape_.size;
  if (side < 2) return {&patches_[static_cast<std::size_t>(color)], 0, away};
  return {&patches_[static_cast<std::size_t>(shape_.colors_h + color)], away, 0};
}

void TileBorders::fill(const Seen& from, const Meeting& area, Patch& tile) const {
  for (int y = area.y; y < area.y + area.height; ++y)
    for (int x = area.x; x < area.x + area.width; ++x) tile.at(x, y) = from.at(x, y);
}

/// @param side  side(x, y) of a texel of the tile
template <class Side>
void TileBorders::meet(const Seen& first, const Seen& second, const Meeting& area, Side&& side, Patch& tile,
                       SeamSum& seams) const {
  std::vector<Vec2> a, b;
  std::vector<SeamSide> given;
  for (int y = area.y; y < area.y + area.height; ++y)
    for (int x = area.x; x < area.x + area.width; ++x) {
      a.push_back(first.at(x, y));
      b.push_back(second.at(x, y));
      given.push_back(side(x, y));
    }
  const SeamProblem problem = {area.width, area.height, a, b, given};
  const std::vector<SeamSide> sides = cutSeam(problem);
  addSeams(problem, sides, seams);
  for (std::size_t k = 0; k < sides.size(); ++k) {
    const int x = area.x + static_cast<int>(k) % area.width, y = area.y + static_cast<int>(k) / area.width;
    tile.at(x, y) = sides[k] == SeamSide::first ? a[k] : b[k];
  }
}

void TileBorders::composeCorners(const WangColors& colors, Patch& tile, SeamSum& seams) const {
  const int size = shape_.size, depth = overlap_, begin = size / 2 - depth, end = size / 2 + depth, last = size - 1;
  const auto seen = [&](int right, int up) { return corner(colors[static_cast<std::size_t>(2 * up + right)], right, up); };
  const auto colorAt = [&](int right, int up) { return colors[static_cast<std::size_t>(2 * up + right)]; };
  for (int far = 0; far < 2; ++far) {
    const int low = far == 0 ? 0 : size - depth, outermost = far == 0 ? 0 : last;
    for (int second = 0; second < 2; ++second) {
      const int from = second == 0 ? 0 : end, length = second == 0 ? begin : size - end;
      fill(seen(second, far), {from, low, length, depth}, tile);
      fill(seen(far, second), {low, from, depth, length}, tile);
    }
    // The middle of the south or north side, and of the west or east side.
    const auto sideAt = [&](int along, int across, int place) {
      if (across == outermost) return along < place ? SeamSide::first : SeamSide::second;
      return along == begin ? SeamSide::first : along == end - 1 ? SeamSide::second : SeamSide::free;
    };
    const int horizontal = place(colorAt(0, far), colorAt(1, far), false);
    const int vertical = place(colorAt(far, 0), colorAt(far, 1), true);
    meet(
        seen(0, far), seen(1, far), {begin, low, 2 * depth, depth}, [&](int x, int y) { return sideAt(x, y, horizontal); },
        tile, seams);
    meet(
        seen(far, 0), seen(far, 1), {low, begin, depth, 2 * depth}, [&](int x, int y) { return sideAt(y, x, vertical); }, tile,
        seams);
  }
}

void TileBorders::composeEdges(const WangColors& colors, Patch& tile, SeamSum& seams) const {
  const int size = shape_.size, depth = overlap_, far = size - depth, last = size - 1;
  for (int side = 0; side < 4; ++side) {
    const Seen seen = edge(side, colors[static_cast<std::size_t>(side)]);
    const int low = side % 2 == 0 ? 0 : far;
    fill(seen, side < 2 ? Meeting{depth, low, size - 2 * depth, depth} : Meeting{low, depth, depth, size - 2 * depth}, tile);
  }
  for (int up = 0; up < 2; ++up)
    for (int right = 0; right < 2; ++right) {
      const Seen horizontal = edge(up, colors[static_cast<std::size_t>(up)]);
      const Seen vertical = edge(2 + right, colors[static_cast<std::size_t>(2 + right)]);
      // Outermost texels belong to their edge, except the one in the corner; so do texels at the ends of the overlap.
      const auto sideAt = [&](int x, int y) {
        const int dx = right ? last - x : x, dy = up ? last - y : y;
        if (dx == dy) return SeamSide::free;
        if (dy == 0 || dx == depth - 1) return SeamSide::first;
        return dx == 0 || dy == depth - 1 ? SeamSide::second : SeamSide::free;
      };
      meet(horizontal, vertical, {right ? far : 0, up ? far : 0, depth, depth}, sideAt, tile, seams);
    }
}

}  // namespace glint::bake
