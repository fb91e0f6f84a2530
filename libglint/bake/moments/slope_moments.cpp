#include "glint/bake/moments/slope_moments.h"

#include <tbb/parallel_for.h>

#include <algorithm>
#include <atomic>
#include <cmath>

#include "glint/model/error.h"
#include "glint/model/slope_sums.h"
#include "glint/query/detail/moments/moment_mixture.h"

namespace glint::bake {
namespace {

/// The texels of the level before, along one axis, that a texel covers: `count` of them from `first` on, and their shares.
struct Cover {
  static constexpr int kMost = 4;  // a texel is at most 3 texels of the level before wide, and begins anywhere
  int first = 0, count = 0;
  float shares[kMost] = {};
};

std::vector<Cover> coversOf(int before, int after) {
  std::vector<Cover> covers(static_cast<std::size_t>(after));
  const double width = static_cast<double>(before) / after;
  for (int k = 0; k < after; ++k) {
    const double low = k * width, high = k + 1 == after ? before : (k + 1) * width;
    Cover& cover = covers[static_cast<std::size_t>(k)];
    cover.first = static_cast<int>(low);
    for (int i = cover.first; i < high && cover.count < Cover::kMost; ++i)
      cover.shares[cover.count++] = static_cast<float>((std::min(high, i + 1.0) - std::max(low, 1.0 * i)) / width);
  }
  return covers;
}

MapSlopes asMoments(Vec2 slope) { return {slope, {}}; }
const MapSlopes& asMoments(const MapSlopes& moments) { return moments; }

/// Averages rows of a level into one row of the next.
/// @param rows  rows.count rows of the level, from rows.first on
template <class Texel>
void averageRows(const Cover& rows, const Texel* const (&row)[Cover::kMost], const std::vector<Cover>& columns,
                 MapSlopes* out) {
  for (std::size_t i = 0; i < columns.size(); ++i) {
    const Cover& cover = columns[i];
    MomentMixture mixture(asMoments(row[0][cover.first]).mean);
    for (int b = 0; b < rows.count; ++b)
      for (int a = 0; a < cover.count; ++a) mixture.add(rows.shares[b] * cover.shares[a], asMoments(row[b][cover.first + a]));
    out[i] = mixture.moments();
  }
}

/// A level that is being built.
struct Level {
  int columns, rows;
  std::vector<MapSlopes> texels;

  Level(int columns_, int rows_) : columns(columns_), rows(rows_), texels(rowMajorIndex(0, rows_, columns_)) {}
  MapSlopes* row(int j) { return texels.data() + rowMajorIndex(0, j, columns); }
  const MapSlopes* row(int j) const { return texels.data() + rowMajorIndex(0, j, columns); }
};

/// Level 0: the slopes themselves, and the variances inside texels.
template <class RowSlopes>
Level texelLevel(int width, int height, std::span<const float> variances, const RowSlopes& row_slopes) {
  Level level(width, height);
  tbb::parallel_for(0, height, [&](int j) {
    std::vector<Vec2> slopes(static_cast<std::size_t>(width));
    row_slopes(j, std::span(slopes));
    std::transform(slopes.begin(), slopes.end(), level.row(j), [](Vec2 s) { return asMoments(s); });
    if (variances.empty()) return;
    for (int i = 0; i < width; ++i) {
      Covariance& c = level.row(j)[i].covariance;
      c.xx = c.yy = variances[rowMajorIndex(i, j, width)];
    }
  });
  return level;
}

/// Level 1 from the slopes, without level 0 in memory.
template <class RowSlopes>
Level firstLevel(int width, int height, const RowSlopes& row_slopes) {
  Level level(SlopeMoments::chainSize(width, 1), SlopeMoments::chainSize(height, 1));
  const std::vector<Cover> columns = coversOf(width, level.columns), rows = coversOf(height, level.rows);
  tbb::parallel_for(0, level.rows, [&](int j) {
    const Cover& cover = rows[static_cast<std::size_t>(j)];
    std::vector<Vec2> slopes(rowMajorIndex(0, cover.count, width));
    const Vec2* row[Cover::kMost] = {};
    for (int b = 0; b < cover.count; ++b) {
      const std::span<Vec2> line = std::span(slopes).subspan(rowMajorIndex(0, b, width), static_cast<std::size_t>(width));
      row_slopes(cover.first + b, line);
      row[b] = line.data();
    }
    averageRows(cover, row, columns, level.row(j));
  });
  return level;
}

Level nextLevel(const Level& before) {
  Level level(SlopeMoments::chainSize(before.columns, 1), SlopeMoments::chainSize(before.rows, 1));
  const std::vector<Cover> columns = coversOf(before.columns, level.columns), rows = coversOf(before.rows, level.rows);
  tbb::parallel_for(0, level.rows, [&](int j) {
    const Cover& cover = rows[static_cast<std::size_t>(j)];
    const MapSlopes* row[Cover::kMost] = {};
    for (int b = 0; b < cover.count; ++b) row[b] = before.row(cover.first + b);
    averageRows(cover, row, columns, level.row(j));
  });
  return level;
}

/// @param row_slopes  row_slopes(j, span of the width): writes the slopes of row j
template <class RowSlopes>
SlopeMomentsData build(int width, int height, const SlopeMomentsOptions& options, const RowSlopes& row_slopes,
                       const ProgressFn& progress) {
  const int length = SlopeMoments::chainLength(width, height);
  const int finest = std::clamp(options.finest_level, 0, length - 1);
  SlopeMomentsData data;
  SlopeMoments& shape = data.shape;
  shape.width = width, shape.height = height;
  shape.boundary = options.boundary;
  shape.finest_level = finest;
  ProgressCounter counter(progress, static_cast<std::size_t>(length));
  int l = options.facet_variances.empty() ? std::min(finest, 1) : 0;
  Level level = l == 0 ? texelLevel(width, height, options.facet_variances, row_slopes) : firstLevel(width, height, row_slopes);
  for (;; ++l) {
    counter.advance();
    Level next = l + 1 < length ? nextLevel(level) : Level(0, 0);
    if (l >= finest) {
      SlopeMomentsLevel& kept = shape.levels[shape.level_count++];
      kept.columns = level.columns, kept.rows = level.rows;
      data.levels.push_back(std::move(level.texels));
    }
    if (l + 1 == length) break;
    level = std::move(next);
  }
  shape.slopes = data.levels.back().front();
  return data;
}

}  // namespace

std::vector<std::vector<float>> meanHeights(const HeightMap& map) {
  std::vector<std::vector<float>> levels = {{map.heights.begin(), map.heights.end()}};
  for (int l = 1, width = map.width, height = map.height; l < SlopeMoments::chainLength(map.width, map.height); ++l) {
    const std::vector<float>& before = levels.back();
    const int columns = SlopeMoments::chainSize(width, 1), rows = SlopeMoments::chainSize(height, 1);
    const std::vector<Cover> across = coversOf(width, columns), along = coversOf(height, rows);
    std::vector<float> level(rowMajorIndex(0, rows, columns));
    tbb::parallel_for(0, rows, [&](int j) {
      const Cover& y = along[static_cast<std::size_t>(j)];
      for (int i = 0; i < columns; ++i) {
        const Cover& x = across[static_cast<std::size_t>(i)];
        float sum = 0;
        for (int b = 0; b < y.count; ++b)
          for (int a = 0; a < x.count; ++a)
            sum += y.shares[b] * x.shares[a] * before[rowMajorIndex(x.first + a, y.first + b, width)];
        level[rowMajorIndex(i, j, columns)] = sum;
      }
    });
    levels.push_back(std::move(level));
    width = columns, height = rows;
  }
  return levels;
}

SlopeMoments SlopeMomentsData::view() const {
  SlopeMoments moments = shape;
  for (std::size_t l = 0; l < levels.size(); ++l) moments.levels[l].texels = levels[l];
  return moments;
}

std::size_t SlopeMomentsData::sizeBytes() const {
  std::size_t size = 0;
  for (const auto& level : levels) size += level.size() * sizeof(MapSlopes);
  return size;
}

SlopeMomentsData buildSlopeMoments(const NormalMap& map, const SlopeMomentsOptions& options, const ProgressFn& progress) {
  const auto row_slopes = [&](int j, std::span<Vec2> slopes) {
    const Vec2* normals = map.normals.data() + rowMajorIndex(0, j, map.width);
    for (std::size_t i = 0; i < slopes.size(); ++i) slopes[i] = slopeOf(normals[i]);
  };
  return build(map.width, map.height, options, row_slopes, progress);
}

SlopeMomentsData buildSlopeMoments(const HeightMap& map, const SlopeMomentsOptions& options, const ProgressFn& progress) {
  constexpr float kSteepest = 1e6f;  // as files may hold
  std::atomic<bool> steep = false;
  const auto row_slopes = [&](int j, std::span<Vec2> slopes) {
    rowSlopes(map.width, map.height, map.heights, j, options.boundary, options.gradient, slopes);
    const auto usable = [](Vec2 s) { return std::abs(s.x) <= kSteepest && std::abs(s.y) <= kSteepest; };
    if (!std::all_of(slopes.begin(), slopes.end(), usable)) steep = true;
  };
  SlopeMomentsData data = build(map.width, map.height, options, row_slopes, progress);
  if (steep) {
    throw Error(ErrorCode::invalid_input, "heights.steep", {}, "/heights", "are not finite, or have slopes above 1e6",
                "make the heights again with glint-ingest --height-scale");
  }
  return data;
}

}  // namespace glint::bake
