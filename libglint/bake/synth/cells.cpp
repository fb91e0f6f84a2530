#include <tbb/parallel_for.h>

#include <algorithm>
#include <cmath>
#include <limits>
#include <numbers>

#include "glint/bake/common/counter_random.h"
#include "glint/bake/synth/kinds.h"

namespace glint::bake {
namespace {

constexpr std::uint64_t kSiteStream = 2;
constexpr std::uint64_t kOrientationStream = 3;
constexpr std::uint64_t kBumpStream = 6;

/// A periodic grid with one random point (site) in each cell. Cells are as nearly square, and of the wanted size, as the map's
/// size allows.
class JitteredGrid {
 public:
  JitteredGrid(const SynthOptions& p, float cell_texels)
      : columns_(std::max(1, static_cast<int>(std::lround(static_cast<float>(p.width) / cell_texels)))),
        rows_(std::max(1, static_cast<int>(std::lround(static_cast<float>(p.height) / cell_texels)))),
        cell_width_(static_cast<float>(p.width) / static_cast<float>(columns_)),
        cell_height_(static_cast<float>(p.height) / static_cast<float>(rows_)),
        sites_(static_cast<std::size_t>(columns_) * rows_) {
    for (std::size_t cell = 0; cell < sites_.size(); ++cell) sites_[cell] = randomPair(p.seed, kSiteStream, cell);
  }

  struct Site {
    int cell;       ///< row * columns + column, wrapped
    Vec2 position;  ///< texels, not wrapped into the map
  };

  /// Calls visit(site) for the 5 x 5 cells around a point. The two sites nearest to the point are always among them.
  template <class Visit>
  void visitNear(Vec2 point, const Visit& visit) const {
    const int column = static_cast<int>(point.x / cell_width_);
    const int row = static_cast<int>(point.y / cell_height_);
    for (int y = row - 2; y <= row + 2; ++y) {
      const int wrapped_row = wrap(y, rows_);
      for (int x = column - 2; x <= column + 2; ++x) {
        const int cell = wrapped_row * columns_ + wrap(x, columns_);
        const Vec2 jitter = sites_[static_cast<std::size_t>(cell)];
        visit(
            Site{cell, {(static_cast<float>(x) + jitter.x) * cell_width_, (static_cast<float>(y) + jitter.y) * cell_height_}});
      }
    }
  }

  Site nearest(Vec2 point) const {
    Site best{};
    float smallest = std::numeric_limits<float>::max();
    visitNear(point, [&](const Site& site) {
      const Vec2 d = site.position - point;
      const float distance2 = dot(d, d);
      if (distance2 < smallest) {
        smallest = distance2;
        best = site;
      }
    });
    return best;
  }

  std::size_t cellCount() const { return sites_.size(); }

 private:
  static int wrap(int i, int n) {
    const int rest = i % n;
    return rest < 0 ? rest + n : rest;
  }

  int columns_;
  int rows_;
  float cell_width_;
  float cell_height_;
  std::vector<Vec2> sites_;
};

/// cos^2 of the tilt at quantile u of the GTR distribution weighted by projected area (Burley 2012, Eqs. 5 and 6).
double gtrCosineSquared(double u, double alpha, double gamma) {
  const double a2 = alpha * alpha;
  if (std::abs(gamma - 1) < 1e-6) return (1 - std::pow(a2, 1 - u)) / (1 - a2);
  return (1 - std::pow(std::pow(a2, 1 - gamma) * (1 - u) + u, 1 / (1 - gamma))) / (1 - a2);
}

/// Quantile of cos^2 of the tilt: the inverse of gtrCosineSquared.
double gtrQuantile(double cosine_squared, double alpha, double gamma) {
  const double a2 = alpha * alpha;
  const double t = 1 - cosine_squared * (1 - a2);
  if (std::abs(gamma - 1) < 1e-6) return 1 - std::log(t) / std::log(a2);
  const double a = std::pow(a2, 1 - gamma);
  return (std::pow(t, 1 - gamma) - a) / (1 - a);
}

/// Height, at a point, of the dome over its Voronoi cell: 0 on the border of the cell, 1 farther than `rim` from it. The height
/// is a product over the sides of the cell, so that corners are rounded and no crease runs inwards from them.
float domeHeight(const JitteredGrid& grid, Vec2 point, float rim) {
  const JitteredGrid::Site own = grid.nearest(point);
  float height = 1;
  grid.visitNear(point, [&](const JitteredGrid::Site& site) {
    const Vec2 across = site.position - own.position;
    const float length2 = dot(across, across);
    if (length2 < 1e-8f) return;
    const Vec2 middle = 0.5f * (site.position + own.position);
    const float along = dot(middle - point, across);
    if (along * along >= rim * rim * length2) return;  // the point is farther than the rim from this side
    const float inside = std::max(0.0f, along) / (rim * std::sqrt(length2));
    height *= inside * (2 - inside);
  });
  return height;
}

}  // namespace

std::vector<Vec2> flakeNormals(const SynthOptions& p) {
  const JitteredGrid grid(p, p.feature_texels);
  // Draw an orientation for each flake, then find the flake of each texel.
  const double last_quantile = gtrQuantile(kMinFlakeCosine * kMinFlakeCosine, p.alpha, p.gamma);
  std::vector<Vec2> orientations(grid.cellCount());
  for (std::size_t cell = 0; cell < orientations.size(); ++cell) {
    const Vec2 xi = randomPair(p.seed, kOrientationStream, cell);
    const double sine = std::sqrt(1 - gtrCosineSquared(xi.x * last_quantile, p.alpha, p.gamma));
    const double angle = 2 * std::numbers::pi * xi.y;
    orientations[cell] = {static_cast<float>(sine * std::cos(angle)), static_cast<float>(sine * std::sin(angle))};
  }
  std::vector<Vec2> normals(static_cast<std::size_t>(p.width) * p.height);
  tbb::parallel_for(0, p.height, [&](int j) {
    Vec2* line = normals.data() + static_cast<std::size_t>(j) * p.width;
    for (int i = 0; i < p.width; ++i) {
      const Vec2 centre = {static_cast<float>(i) + 0.5f, static_cast<float>(j) + 0.5f};
      line[i] = orientations[static_cast<std::size_t>(grid.nearest(centre).cell)];
    }
  });
  return normals;
}

std::vector<float> bumpHeights(const SynthOptions& p) {
  const JitteredGrid grid(p, p.feature_texels);
  std::vector<float> radii(grid.cellCount());
  for (std::size_t cell = 0; cell < radii.size(); ++cell)
    radii[cell] = p.feature_texels * (0.25f + 0.25f * randomPair(p.seed, kBumpStream, cell).x);
  std::vector<float> heights(static_cast<std::size_t>(p.width) * p.height);
  tbb::parallel_for(0, p.height, [&](int j) {
    float* line = heights.data() + static_cast<std::size_t>(j) * p.width;
    for (int i = 0; i < p.width; ++i) {
      const Vec2 centre = {static_cast<float>(i) + 0.5f, static_cast<float>(j) + 0.5f};
      float highest = 0;
      grid.visitNear(centre, [&](const JitteredGrid::Site& site) {
        const Vec2 d = site.position - centre;
        const float radius = radii[static_cast<std::size_t>(site.cell)];
        const float inside = std::max(0.0f, 1 - dot(d, d) / (radius * radius));
        highest = std::max(highest, radius * inside * inside);
      });
      line[i] = highest;
    }
  });
  return heights;
}

std::vector<float> leatherHeights(const SynthOptions& p) {
  const JitteredGrid pebbles(p, p.feature_texels);
  const float rim = 0.35f * p.feature_texels;  // width of the rounded border of a pebble
  std::vector<float> heights(static_cast<std::size_t>(p.width) * p.height);
  tbb::parallel_for(0, p.height, [&](int j) {
    float* line = heights.data() + static_cast<std::size_t>(j) * p.width;
    for (int i = 0; i < p.width; ++i) {
      const Vec2 centre = {static_cast<float>(i) + 0.5f, static_cast<float>(j) + 0.5f};
      line[i] = domeHeight(pebbles, centre, rim);
    }
  });
  return heights;
}

}  // namespace glint::bake
