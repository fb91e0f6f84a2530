#include "glint/bake/displace/low_brdf.h"

#include <tbb/parallel_for.h>

#include <algorithm>
#include <bit>
#include <cmath>
#include <numbers>

#include "glint/bake/common/simd.h"
#include "glint/bake/displace/effective_kernels.h"
#include "glint/bake/displace/ordered_sums.h"
#include "glint/bake/displace/table_kernels.h"
#include "glint/query/brdf/vmf_lobe.h"

namespace glint::bake {
namespace {

constexpr std::size_t kMostCells = 4096;  // cells that are summed, in all patches together
constexpr std::size_t kChunkCells = 32;   // cells whose sum a float holds exactly enough

/// Cuts a surface into smaller cells: the same triangles with `parts` times the vertices along each axis.
/// @return heights of the vertices, in the smaller cells
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

/// Half vectors and Fresnel factors of all pairs of directions: GGX lobes of all cells share them.
struct PairTable {
  std::vector<float> x, y, z, fresnel;  ///< [directions][padded directions]; x, y and z are half vectors
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

/// row[o] = ggxLobe times Fresnel's factor, for one light direction and every view direction o from `first` on.
GLINT_MULTIVERSION void ggxLobeRow(const DirectionTable& directions, const PairTable& pairs, float alpha, const VmfLobe& lobe,
                                   std::size_t light, std::size_t first, float* row) {
  const Vec3 centre = lobeCentre(lobe), wi = directions.at(light);
  const std::size_t padded = directions.padded, begin = light * padded;
  const float *ox = directions.x.data(), *oy = directions.y.data(), *oz = directions.z.data();
  const float *hx = &pairs.x[begin], *hy = &pairs.y[begin], *hz = &pairs.z[begin], *fresnel = &pairs.fresnel[begin];
  for (std::size_t o = first; o < padded; ++o)
    row[o] = fresnel[o] * ggxLobe(alpha, centre, lobe.kappa, wi, {ox[o], oy[o], oz[o]}, {hx[o], hy[o], hz[o]});
}

/// out[channel][i][o] += weights[channel] * ggxLobe * Fresnel's factor, for i <= o.
void addGgxLobe(const DirectionTable& directions, const PairTable& pairs, float alpha, const VmfLobe& lobe,
                std::span<const float> weights, float* row, float* out) {
  const std::size_t padded = directions.padded;
  for (std::size_t i = 0; i < directions.count; ++i) {
    const std::size_t first = i / 8 * 8;
    ggxLobeRow(directions, pairs, alpha, lobe, i, first, row);
    for (std::size_t c = 0; c < weights.size(); ++c)
      for (std::size_t o = first; o < padded; ++o) out[(c * padded + i) * padded + o] += weights[c] * row[o];
  }
}

/// lobeCosines of a pair of directions as a sum of products of one factor for each direction: five rows of factors for every
/// lobe, one for each term of the lobe's moments. A matrix product then sums all pairs and lobes.
struct DiffuseRows {
  std::vector<float> values;  ///< [rows][padded directions]
  std::vector<float> scales;  ///< [rows]: moment of the term, times the lobe's amplitude
};

void fillDiffuseRows(const DirectionTable& directions, std::span<const VmfLobe> lobes, DiffuseRows& rows) {
  const std::size_t padded = directions.padded;
  rows.scales.clear();
  for (const VmfLobe& lobe : lobes) {
    if (lobe.amplitude <= 0) break;
    const LobeMoments moments = lobeMoments(lobe.kappa);
    const Vec3 centre = lobeCentre(lobe);
    float* row = &rows.values[rows.scales.size() * padded];
    for (std::size_t d = 0; d < padded; ++d) {
      const LobeFacing facing = lobeFacing(moments, centre, directions.at(d));
      row[d] = facing.lit;
      row[padded + d] = facing.visible * directions.x[d];
      row[2 * padded + d] = facing.visible * directions.y[d];
      row[3 * padded + d] = facing.visible * directions.z[d];
      row[4 * padded + d] = facing.visible * facing.cosine;
    }
    for (const float scale : {1.0f, moments.spread, moments.spread, moments.spread, moments.bias})
      rows.scales.push_back(lobe.amplitude * scale);
  }
}

/// Directions in a space where the cells of a grid are squares of the length `factor`. Which facets a direction sees, and on
/// which side of them it is, are the same there.
std::vector<Vec3> squared(std::span<const Vec3> directions, const PatchGrid& grid) {
  std::vector<Vec3> out(directions.begin(), directions.end());
  const float across = static_cast<float>(grid.factor) / grid.cells().cellWidth(),
              up = static_cast<float>(grid.factor) / grid.cells().cellHeight();
  if (across == 1 && up == 1) return out;
  for (Vec3& w : out) {
    const Vec3 stretched = {across * w.x, up * w.y, w.z};
    w = (1 / std::sqrt(dot(stretched, stretched))) * stretched;
  }
  return out;
}

/// Sums the light that the cells of a downsampled surface reflect.
class LowEstimator {
 public:
  LowEstimator(std::span<const float> heights, const LobeField& field, std::span<const Vec3> directions, const PatchGrid& grid)
      : field_(field),
        directions_(directions),
        pairs_(directions_, field.base),
        grid_(grid),
        parts_(heights.size() <= 4 * kMostCells    ? 4
               : heights.size() <= 16 * kMostCells ? 2
                                                   : 1),
        heights_(refined(grid.coarse_x, grid.coarse_y, heights, parts_)),
        surface_(grid.coarse_x * parts_, grid.coarse_y * parts_, heights_),
        seen_(squared(directions, grid)),
        masks_(surface_, squared(directions, grid)) {
    if (field.table.empty()) return;
    frames_ = PairFrames(directions_);
    tables_ = TableNodes(field.table, kBaseTableDifference, kBaseTableHalf, static_cast<int>(field.channels));
  }

  EffectiveBrdf sum() const {
    // Zeros for all patches.
    EffectiveBrdf result;
    const std::size_t n = directions_.count;
    result.directions = n;
    result.patches = static_cast<std::size_t>(grid_.count());
    result.channels = field_.channels;
    result.values.resize(result.channels * result.patches * n * n);
    // Cut the cells of every patch into chunks, and sum each chunk in float.
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
    const auto sumOf = [&](std::size_t c) {
      const Chunk& chunk = chunks[c];
      std::vector<float> sums(field_.channels * n * n);
      addCells(std::span(cells[static_cast<std::size_t>(chunk.patch)]).subspan(chunk.first, chunk.last - chunk.first),
               sums.data());
      return sums;
    };
    // Pairs i > o are the same as o < i.
    addInOrder(chunks.size(), field_.channels * n * n * sizeof(float), sumOf, [&](std::size_t c, const auto& sums) {
      const auto patch = static_cast<std::size_t>(chunks[c].patch);
      const float scale = 1 / static_cast<float>(cells[patch].size());
      for (std::size_t channel = 0; channel < field_.channels; ++channel)
        for (std::size_t i = 0; i < n; ++i)
          for (std::size_t o = 0; o < n; ++o)
            result.values[((channel * result.patches + patch) * n + i) * n + o] +=
                scale * sums[(channel * n + std::min(i, o)) * n + std::max(i, o)];
    });
    return result;
  }

 private:
  /// Cells of a patch, or an even choice from them where there are more than kMostCells.
  std::vector<std::size_t> cellsOf(int patch) const {
    const int c = patch % grid_.columns, r = patch / grid_.columns;
    std::vector<std::size_t> all;
    for (int j = grid_.firstCellRow(r); j < grid_.firstCellRow(r + 1); ++j)
      for (int i = grid_.firstCellColumn(c); i < grid_.firstCellColumn(c + 1); ++i)
        all.push_back(static_cast<std::size_t>(j) * grid_.coarse_x + static_cast<std::size_t>(i));
    const std::size_t most = std::max<std::size_t>(1, kMostCells / static_cast<std::size_t>(grid_.count()));
    if (all.size() <= most) return all;
    std::vector<std::size_t> some;
    for (std::size_t k = 0; k < most; ++k) some.push_back(all[(2 * k + 1) * all.size() / (2 * most)]);
    return some;
  }

  /// Sets bit k of bits[d] where facet k of a cell faces direction d and is visible from there. A cell has at most 32 facets.
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
        multiplyCosines(seen_, surface_.normal(facet), row.data());
        for (std::size_t d = 0; d < directions_.count; ++d) bits[d] |= std::uint64_t{row[d] > 0} << bit;
      }
    }
  }

  /// Memory that one task uses again for every cell.
  struct Scratch {
    Scratch(const DirectionTable& directions, std::size_t channels)
        : pairs(channels * directions.padded * directions.padded),
          left(5 * kMaxLobes * directions.padded),
          row(directions.padded),
          bits(directions.count) {
      rows.values.resize(left.size());
    }
    std::vector<float> pairs;  ///< [channels][padded directions][padded directions]
    std::vector<float> left;   ///< rows of DiffuseRows, times their scales
    std::vector<float> row;
    DiffuseRows rows;
    std::vector<std::uint64_t> bits;
  };

  /// Colour of a lobe: its factor of the base.
  float color(std::size_t lobe, std::size_t channel) const {
    return field_.colors.empty() ? 1.0f : field_.colors[lobe * field_.channels + channel];
  }

  /// Computes the integral of f cos(wi) cos(wo) D of a cell, for all pairs i <= o.
  void fillPairs(std::size_t cell, Scratch& s) const {
    std::fill(s.pairs.begin(), s.pairs.end(), 0.0f);
    const std::size_t first = cell * field_.lobe_count, padded = directions_.padded;
    const auto lobes = field_.lobes.subspan(first, field_.lobe_count);
    if (field_.base.kind == BaseBrdf::Kind::diffuse) {
      fillDiffuseRows(directions_, lobes, s.rows);
      for (std::size_t c = 0; c < field_.channels; ++c) {
        for (std::size_t r = 0; r < s.rows.scales.size(); ++r) {
          const float scale = field_.base.albedo / std::numbers::pi_v<float> * color(first + r / 5, c) * s.rows.scales[r];
          for (std::size_t d = 0; d < padded; ++d) s.left[r * padded + d] = scale * s.rows.values[r * padded + d];
        }
        addProducts(s.left.data(), s.rows.values.data(), s.rows.scales.size(), padded, &s.pairs[c * padded * padded]);
      }
      return;
    }
    for (std::size_t l = 0; l < lobes.size() && lobes[l].amplitude > 0; ++l) {
      const float alpha = field_.alphas.empty() ? field_.base.alpha : field_.alphas[first + l];
      float weights[3];
      for (std::size_t c = 0; c < field_.channels; ++c) weights[c] = lobes[l].amplitude * color(first + l, c);
      if (field_.base.kind == BaseBrdf::Kind::table) {
        addTableLobe(directions_, frames_, tables_, lobes[l], {weights, field_.channels}, s.pairs.data());
        continue;
      }
      addGgxLobe(directions_, pairs_, alpha, lobes[l], {weights, field_.channels}, s.row.data(), s.pairs.data());
    }
  }

  /// Adds the light that cells reflect, times the share of each cell's facets that both directions see.
  void addCells(std::span<const std::size_t> cells, float* sums) const {
    const std::size_t n = directions_.count, padded = directions_.padded;
    Scratch s(directions_, field_.channels);
    const float share = 1 / static_cast<float>(2 * parts_ * parts_);
    for (const std::size_t cell : cells) {
      fillPairs(cell, s);
      facetBits(cell, s.bits);
      for (std::size_t i = 0; i < n; ++i) {
        for (std::size_t o = i; o < n; ++o) {
          const float shown = share * static_cast<float>(std::popcount(s.bits[i] & s.bits[o]));
          for (std::size_t c = 0; c < field_.channels; ++c)
            sums[(c * n + i) * n + o] += shown * std::max(0.0f, s.pairs[(c * padded + i) * padded + o]);
        }
      }
    }
  }

  LobeField field_;
  DirectionTable directions_;
  PairTable pairs_;
  PairFrames frames_;  ///< of a table, as tables_
  TableNodes tables_;
  PatchGrid grid_;
  int parts_;  ///< smaller cells along a side of a cell, so that a cell can be shadowed in part
  std::vector<float> heights_;
  HeightSurface surface_;
  DirectionTable seen_;  ///< the directions as the surface of square cells sees them
  VisibilityMasks masks_;
};

}  // namespace

EffectiveBrdf lowBrdf(std::span<const float> heights, const LobeField& field, std::span<const Vec3> directions,
                      const PatchGrid& grid) {
  return LowEstimator(heights, field, directions, grid).sum();
}

}  // namespace glint::bake
