#include <tbb/parallel_for.h>

#include <algorithm>
#include <cmath>
#include <cstdint>
#include <numbers>

#include "glint/bake/synth/kinds.h"
#include "glint/math/lookup3.h"

namespace glint::bake {
namespace {

constexpr float kTwoPi = 2 * std::numbers::pi_v<float>;
/// Half the edge of the cube that a flake is cut from, in cells: half of sqrt(3).
const float kHalfEdge = 1.5f / std::sqrt(3.0f);
const float kSteepestTangent = std::sqrt(1 - kMinFlakeCosine * kMinFlakeCosine) / kMinFlakeCosine;

struct Point3 {
  float x, y, z;
};

/// The hash of cells that OSL and MaterialX use: lookup3 over the words of one key.
class CellHash {
 public:
  /// @param words  words of the whole key, which the hash counts
  explicit CellHash(std::uint32_t words) : state_((words << 2) + 13) {}

  void add(std::uint32_t x, std::uint32_t y, std::uint32_t z) { state_.add(x, y, z); }

  /// Stirs three words, where more words follow.
  void mix() { state_.mix(); }

  /// A number in [0, 1], of the last words.
  float number() const { return static_cast<float>(Lookup3(state_).finish()) / 4294967295.0f; }

 private:
  Lookup3 state_;
};

/// A cell of the node's grid, as the hash counts it.
struct Cell {
  std::uint32_t x, y, z;

  float number() const {
    CellHash hash(3);
    hash.add(x, y, z);
    return hash.number();
  }

  /// Number of the cell with a fourth coordinate.
  float number(std::uint32_t w) const {
    CellHash hash(4);
    hash.add(x, y, z);
    hash.mix();
    hash.add(w, 0, 0);
    return hash.number();
  }

  /// Three numbers: of the cell with a fourth coordinate of 0, 1 and 2.
  Point3 numbers() const { return {number(0), number(1), number(2)}; }

  /// Three numbers: of the cell with the fourth coordinate w and a fifth of 0, 1 and 2.
  Point3 numbers(std::uint32_t w) const {
    CellHash hash(5);
    hash.add(x, y, z);
    hash.mix();
    const auto of = [&](std::uint32_t fifth) {
      CellHash whole = hash;
      whole.add(w, fifth, 0);
      return whole.number();
    };
    return {of(0), of(1), of(2)};
  }
};

/// Whether a point, relative to the centre of its flake, lies in the cube that the numbers turn: Arvo's random rotation ("Fast
/// random rotation matrices", Graphics Gems III, 1992).
bool isInTurnedCube(Point3 p, Point3 xi) {
  const float theta = kTwoPi * xi.x, phi = kTwoPi * xi.y, z = 2 * xi.z;
  const float r = std::sqrt(z);
  const Point3 v = {std::sin(phi) * r, std::cos(phi) * r, std::sqrt(2 - z)};
  const float sine = std::sin(theta), cosine = std::cos(theta);
  const float sx = v.x * cosine - v.y * sine, sy = v.x * sine + v.y * cosine;
  const float x = (v.x * sx - cosine) * p.x + (v.y * sx + sine) * p.y + v.z * sx * p.z;
  const float y = (v.x * sy - sine) * p.x + (v.y * sy - cosine) * p.y + v.z * sy * p.z;
  const float across = v.x * v.z * p.x + v.y * v.z * p.y + (1 - z) * p.z;
  return std::abs(x) <= kHalfEdge && std::abs(y) <= kHalfEdge && std::abs(across) <= kHalfEdge;
}

/// Share of cells that have a flake, so that flakes cover the share `coverage` of the plane: the fit that the node has.
float probabilityOf(float coverage) {
  const float x = coverage, xx = x * x;
  return (-26.19771808f * xx + 26.39663835f * x) /
         (85.53857017f * xx * x - 102.35069432f * xx - 101.42634862f * x + 118.45082288f);
}

/// The whole number of cells along a side of the map, or 0 if the last cell would be cut.
int wholeCells(double cells) {
  constexpr double kCutShare = 0.01;  // a seam of a hundredth of a cell does not show
  const double nearest = std::round(cells);
  return nearest >= 1 && std::abs(cells - nearest) <= kCutShare ? static_cast<int>(nearest) : 0;
}

class Flakes {
 public:
  explicit Flakes(const SynthOptions& p)
      : size_(p.flake_size_uv), probability_(probabilityOf(p.coverage)), plane_(static_cast<std::uint32_t>(p.seed - 1)) {
    const int columns = wholeCells(1 / double{p.flake_size_uv});
    const int rows = wholeCells(static_cast<double>(p.height) / p.width / p.flake_size_uv);
    if (columns > 0 && rows > 0) columns_ = columns, rows_ = rows;
  }

  bool tiles() const { return columns_ > 0; }

  struct Found {
    float presence = 0;  ///< of the uppermost flake, which hides the others; 0: no flake
    Cell cell{};
  };

  /// The flake at a texture coordinate, searched in the 3 x 3 x 3 cells around it.
  Found at(Vec2 uv) const {
    Found found;
    const Point3 p = {uv.x / size_, uv.y / size_, 0};
    const int column = static_cast<int>(std::floor(p.x)), row = static_cast<int>(std::floor(p.y));
    for (int i = column - 1; i <= column + 1; ++i)
      for (int j = row - 1; j <= row + 1; ++j)
        for (int k = -1; k <= 1; ++k) {
          const Point3 from_centre = {p.x - static_cast<float>(i) - 0.5f, p.y - static_cast<float>(j) - 0.5f,
                                      p.z - static_cast<float>(k) - 0.5f};
          const float distance2 = from_centre.x * from_centre.x + from_centre.y * from_centre.y + from_centre.z * from_centre.z;
          if (distance2 >= kHalfEdge * kHalfEdge * 3) continue;
          const Cell cell = wrapped(i, j, k);
          if (cell.number() > probability_) continue;
          const float presence = cell.number(3);
          if (presence < found.presence || !isInTurnedCube(from_centre, cell.numbers())) continue;
          found = {presence, cell};
        }
    return found;
  }

 private:
  static int wrap(int i, int n) { return n == 0 ? i : (i % n + n) % n; }

  Cell wrapped(int i, int j, int k) const {
    return {static_cast<std::uint32_t>(wrap(i, columns_)), static_cast<std::uint32_t>(wrap(j, rows_)),
            static_cast<std::uint32_t>(k) + plane_};
  }

  float size_;
  float probability_;
  std::uint32_t plane_;         ///< of cells; another plane has other flakes
  int columns_ = 0, rows_ = 0;  ///< cells after which flakes repeat; 0: they do not
};

/// Calls set(texel, flake) for every texel.
template <class Set>
void forTexels(const SynthOptions& p, const Set& set) {
  const Flakes flakes(p);
  const auto width = static_cast<float>(p.width);
  tbb::parallel_for(0, p.height, [&](int j) {
    for (int i = 0; i < p.width; ++i) {
      const Vec2 uv = {(static_cast<float>(i) + 0.5f) / width, (static_cast<float>(j) + 0.5f) / width};
      set(static_cast<std::size_t>(j) * p.width + i, flakes.at(uv));
    }
  });
}

/// Normal of a flake: a quantile of GGX with alpha = roughness^2, not steeper than kMinFlakeCosine.
Vec2 normalOf(const Cell& cell, float roughness) {
  const Point3 xi = cell.numbers(2);
  constexpr float kLeast = 1e-12f;  // the hash may round to 1
  const float tangent = std::min(roughness * roughness * std::sqrt(xi.y / std::max(1 - xi.y, kLeast)), kSteepestTangent);
  const float sine = tangent / std::sqrt(1 + tangent * tangent);
  return {std::cos(kTwoPi * xi.x) * sine, std::sin(kTwoPi * xi.x) * sine};
}

}  // namespace

bool flake2dTiles(const SynthOptions& p) { return Flakes(p).tiles(); }

std::vector<Vec2> flake2dNormals(const SynthOptions& p) {
  std::vector<Vec2> normals(static_cast<std::size_t>(p.width) * p.height);
  forTexels(p, [&](std::size_t texel, const Flakes::Found& flake) {
    normals[texel] = flake.presence > 0 ? normalOf(flake.cell, p.roughness) : Vec2{0, 0};
  });
  return normals;
}

std::vector<float> flake2dPresence(const SynthOptions& p) {
  std::vector<float> presence(static_cast<std::size_t>(p.width) * p.height);
  forTexels(p, [&](std::size_t texel, const Flakes::Found& flake) { presence[texel] = flake.presence; });
  return presence;
}

}  // namespace glint::bake
