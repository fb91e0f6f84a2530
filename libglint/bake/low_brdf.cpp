#include "glint/bake/low_brdf.h"

#include <tbb/parallel_for.h>

#include <algorithm>
#include <bit>
#include <cmath>
#include <numbers>

#include "glint/bake/effective_kernels.h"
#include "glint/bake/simd.h"
#include "glint/query/vmf_lobe.h"

namespace glint::bake {
namespace {

constexpr std::size_t kMostCells = 4096;  // that are summed
constexpr std::size_t kChunkCells = 32;   // whose sum is kept in float

/// The same triangles with `parts` times the vertices along each axis. Lengths are in the new cells.
std::vector<float> refined(int columns, int rows, std::span<const float> heights, int parts) {
  const HeightSurface surface(columns, rows, heights);
  std::vector<float> out(heights.size() * static_cast<std::size_t>(parts) * parts);
  for (int j = 0; j < rows * parts; ++j) {
    for (int i = 0; i < columns * parts; ++i) {
      const std::size_t cell = static_cast<std::size_t>(j / parts) * columns + static_cast<std::size_t>(i / parts);
      const float u = static_cast<float>(i % parts) / static_cast<float>(parts),
                  v = static_cast<float>(j % parts) / static_cast<float>(parts);
      const Vec3 p = u + v <= 1 ? surface.point(2 * cell, u, v) : surface.point(2 * cell + 1, 1 - u, 1 - v);
      out[static_cast<std::size_t>(j) * columns * parts + i] = static_cast<float>(parts) * p.z;
    }
  }
  return out;
}

/// What pairs of directions need for GGX lobes.
struct PairTable {
  std::vector<float> x, y, z, fresnel;  ///< [directions][padded directions]: half vectors
  PairTable(const DirectionTable& directions, const BaseBrdf& base) {
    const std::size_t size = directions.count * directions.padded;
    x.resize(size), y.resize(size), z.resize(size), fresnel.resize(size);
    for (std::size_t i = 0; i < directions.count; ++i) {
      for (std::size_t o = 0; o < directions.padded; ++o) {
        const Vec3 sum = directions.at(i) + directions.at(o);
        const float length = std::sqrt(dot(sum, sum));
        const std::size_t k = i * directions.padded + o;
        x[k] = sum.x / length, y[k] = sum.y / length, z[k] = sum.z / length;
        fresnel[k] = conductorFresnel(0.5f * length, base.eta, base.k);
      }
    }
  }
};

/// out[i][o] += amplitude * ggxLobe for i <= o.
GLINT_MULTIVERSION void addGgxLobe(const DirectionTable& directions, const PairTable& pairs, const BaseBrdf& base,
                                   const VmfLobe& lobe, float* out) {
  const Vec3 centre = lobeCentre(lobe);
  const std::size_t padded = directions.padded;
  const float *ox = directions.x.data(), *oy = directions.y.data(), *oz = directions.z.data();
  for (std::size_t i = 0; i < directions.count; ++i) {
    const Vec3 wi = directions.at(i);
    const std::size_t row = i * padded;
    const float *hx = &pairs.x[row], *hy = &pairs.y[row], *hz = &pairs.z[row], *fresnel = &pairs.fresnel[row];
    for (std::size_t o = i / 8 * 8; o < padded; ++o)
      out[row + o] +=
          lobe.amplitude * ggxLobe(base, centre, lobe.kappa, wi, {ox[o], oy[o], oz[o]}, {hx[o], hy[o], hz[o]}, fresnel[o]);
  }
}

/// The sum of lobeCosines over the lobes of a cell, for all pairs, as a product of few rows: it is one for every term of a moment.
void addDiffuseLobes(const DirectionTable& directions, std::span<const VmfLobe> lobes, float factor, std::vector<float>& left,
                     std::vector<float>& right, float* out) {
  const std::size_t padded = directions.padded;
  std::size_t rows = 0;
  for (const VmfLobe& lobe : lobes) {
    if (lobe.amplitude <= 0) break;
    const LobeMoments moments = lobeMoments(lobe.kappa);
    const Vec3 centre = lobeCentre(lobe);
    const float scale[5] = {1, moments.spread, moments.spread, moments.spread, moments.bias};
    for (std::size_t d = 0; d < padded; ++d) {
      const LobeFacing facing = lobeFacing(moments, centre, directions.at(d));
      const float values[5] = {facing.lit, facing.visible * directions.x[d], facing.visible * directions.y[d],
                               facing.visible * directions.z[d], facing.visible * facing.cosine};
      for (std::size_t r = 0; r < 5; ++r) {
        left[(rows + r) * padded + d] = factor * lobe.amplitude * scale[r] * values[r];
        right[(rows + r) * padded + d] = values[r];
      }
    }
    rows += 5;
  }
  addProducts(left.data(), right.data(), rows, padded, out);
}

/// Sums the cells of a downsampled surface.
class LowEstimator {
 public:
  LowEstimator(std::span<const float> heights, std::span<const VmfLobe> lobes, int lobe_count, const BaseBrdf& base,
               std::span<const Vec3> directions, const PatchGrid& grid)
      : lobes_(lobes),
        lobe_count_(static_cast<std::size_t>(lobe_count)),
        base_(base),
        directions_(directions),
        pairs_(directions_, base),
        grid_(grid),
        parts_(heights.size() <= 4 * kMostCells    ? 4
               : heights.size() <= 16 * kMostCells ? 2
                                                   : 1),
        heights_(refined(grid.coarse_x, grid.coarse_y, heights, parts_)),
        surface_(grid.coarse_x * parts_, grid.coarse_y * parts_, heights_),
        masks_(surface_, directions) {}

  EffectiveBrdf sum() const {
    EffectiveBrdf result;
    const std::size_t n = directions_.count;
    result.directions = n;
    result.values.resize(static_cast<std::size_t>(grid_.count()) * n * n);
    struct Chunk {
      int patch;
      std::size_t first, last;
    };
    std::vector<std::vector<std::size_t>> cells;
    std::vector<Chunk> chunks;
    for (int p = 0; p < grid_.count(); ++p) {
      cells.push_back(cellsOf(p));
      for (std::size_t c = 0; c < cells.back().size(); c += kChunkCells)
        chunks.push_back({p, c, std::min(c + kChunkCells, cells.back().size())});
    }
    std::vector<std::vector<float>> sums(chunks.size());
    tbb::parallel_for(std::size_t{0}, chunks.size(), [&](std::size_t c) {
      const Chunk& chunk = chunks[c];
      sums[c].resize(n * n);
      addCells(std::span(cells[static_cast<std::size_t>(chunk.patch)]).subspan(chunk.first, chunk.last - chunk.first),
               sums[c].data());
    });
    for (std::size_t c = 0; c < chunks.size(); ++c) {
      const auto patch = static_cast<std::size_t>(chunks[c].patch);
      const float scale = 1 / static_cast<float>(cells[patch].size());
      for (std::size_t i = 0; i < n; ++i)
        for (std::size_t o = 0; o < n; ++o)
          result.values[(patch * n + i) * n + o] += scale * sums[c][std::min(i, o) * n + std::max(i, o)];
    }
    return result;
  }

 private:
  /// Cells of a patch, or an even choice of them.
  std::vector<std::size_t> cellsOf(int patch) const {
    const int c = patch % grid_.columns, r = patch / grid_.columns;
    std::vector<std::size_t> all;
    for (int j = grid_.firstRow(r) / grid_.factor; j < grid_.firstRow(r + 1) / grid_.factor; ++j)
      for (int i = grid_.firstColumn(c) / grid_.factor; i < grid_.firstColumn(c + 1) / grid_.factor; ++i)
        all.push_back(static_cast<std::size_t>(j) * grid_.coarse_x + static_cast<std::size_t>(i));
    const std::size_t most = std::max<std::size_t>(1, kMostCells / static_cast<std::size_t>(grid_.count()));
    if (all.size() <= most) return all;
    std::vector<std::size_t> some;
    for (std::size_t k = 0; k < most; ++k) some.push_back(all[(2 * k + 1) * all.size() / (2 * most)]);
    return some;
  }

  /// For each direction, one bit for each facet of a cell that sees and faces it.
  void facetBits(std::size_t cell, std::vector<std::uint64_t>& bits) const {
    std::fill(bits.begin(), bits.end(), 0);
    const std::size_t i = cell % static_cast<std::size_t>(grid_.coarse_x), j = cell / static_cast<std::size_t>(grid_.coarse_x);
    const auto parts = static_cast<std::size_t>(parts_);
    std::vector<float> row(directions_.padded);
    int bit = 0;
    for (std::size_t y = 0; y < parts; ++y) {
      for (std::size_t x = 0; x < 2 * parts; ++x, ++bit) {
        const std::size_t facet = 2 * ((j * parts + y) * static_cast<std::size_t>(surface_.width()) + i * parts) + x;
        masks_.expand(facet, row.data());
        multiplyCosines(directions_, surface_.normal(facet), row.data());
        for (std::size_t d = 0; d < directions_.count; ++d) bits[d] |= std::uint64_t{row[d] > 0} << bit;
      }
    }
  }

  void addCells(std::span<const std::size_t> cells, float* sums) const {
    const std::size_t n = directions_.count, padded = directions_.padded;
    std::vector<float> pairs(padded * padded), left(5 * kMaxLobes * padded), right(5 * kMaxLobes * padded);
    std::vector<std::uint64_t> bits(n);
    const float share = 1 / static_cast<float>(2 * parts_ * parts_);
    for (const std::size_t cell : cells) {
      std::fill(pairs.begin(), pairs.end(), 0.0f);
      const auto lobes = lobes_.subspan(cell * lobe_count_, lobe_count_);
      if (base_.kind == BaseBrdf::Kind::diffuse) {
        addDiffuseLobes(directions_, lobes, base_.albedo / std::numbers::pi_v<float>, left, right, pairs.data());
      } else {
        for (const VmfLobe& lobe : lobes)
          if (lobe.amplitude > 0) addGgxLobe(directions_, pairs_, base_, lobe, pairs.data());
      }
      facetBits(cell, bits);
      for (std::size_t i = 0; i < n; ++i)
        for (std::size_t o = i; o < n; ++o)
          sums[i * n + o] +=
              share * static_cast<float>(std::popcount(bits[i] & bits[o])) * std::max(0.0f, pairs[i * padded + o]);
    }
  }

  std::span<const VmfLobe> lobes_;
  std::size_t lobe_count_;
  BaseBrdf base_;
  DirectionTable directions_;
  PairTable pairs_;
  PatchGrid grid_;
  int parts_;  ///< vertices added along a side of a cell, so that partly shadowed cells are
  std::vector<float> heights_;
  HeightSurface surface_;
  VisibilityMasks masks_;
};

}  // namespace

EffectiveBrdf lowBrdf(std::span<const float> heights, std::span<const VmfLobe> lobes, int lobe_count, const BaseBrdf& base,
                      std::span<const Vec3> directions, const PatchGrid& grid) {
  return LowEstimator(heights, lobes, lobe_count, base, directions, grid).sum();
}

}  // namespace glint::bake
