#include "glint/bake/displace/visibility_masks.h"

#include <tbb/parallel_for.h>
#include <tbb/partitioner.h>

#include <algorithm>
#include <cmath>

#include "glint/bake/common/simd.h"

namespace glint::bake {
namespace {

constexpr int kBatch = 16;         // directions of a task: they fill one 16-bit word of each facet
constexpr float kLowest = -1e30f;  // a horizon that hides nothing

/// The surface, stored for sweeps along one of its axes. The major axis is the axis that sweeps advance along; kernels run over
/// the minor axis.
struct Orientation {
  int major = 0;
  int minor = 0;
  std::vector<float> rows;          ///< [major][minor + 1]: heights of vertices, the first height repeated at the end
  std::vector<float> centroids[2];  ///< [major][minor]: heights of the centroids of the two facets of a cell
  std::size_t major_step = 0;       ///< cells between neighbours along the major axis
  std::size_t minor_step = 0;
};

Orientation orient(const HeightSurface& surface, bool along_x) {
  Orientation o;
  o.major = along_x ? surface.width() : surface.height();
  o.minor = along_x ? surface.height() : surface.width();
  o.major_step = along_x ? 1 : static_cast<std::size_t>(surface.width());
  o.minor_step = along_x ? static_cast<std::size_t>(surface.width()) : 1;
  o.rows.resize(static_cast<std::size_t>(o.major) * (o.minor + 1));
  for (auto& centroids : o.centroids) centroids.resize(static_cast<std::size_t>(o.major) * o.minor);
  const auto row = [&](int a) { return &o.rows[static_cast<std::size_t>(a) * (o.minor + 1)]; };
  tbb::parallel_for(0, o.major, [&](int a) {
    for (int b = 0; b < o.minor; ++b) row(a)[b] = along_x ? surface.at(a, b) : surface.at(b, a);
    row(a)[o.minor] = row(a)[0];
  });
  tbb::parallel_for(0, o.major, [&](int a) {
    const float* here = row(a);
    const float* next = row(a + 1 == o.major ? 0 : a + 1);
    for (int b = 0; b < o.minor; ++b) {
      const std::size_t k = static_cast<std::size_t>(a) * o.minor + b;
      o.centroids[0][k] = (here[b] + here[b + 1] + next[b]) / 3;
      o.centroids[1][k] = (next[b + 1] + here[b + 1] + next[b]) / 3;
    }
  });
  return o;
}

/// A position along the minor axis, wrapped into the map: whole cells and the rest.
struct Shift {
  int whole;
  float part;
};

Shift shiftOf(double position, int size) {
  const double whole = std::floor(position);
  const double wrapped = whole - std::floor(whole / size) * size;
  return {static_cast<int>(wrapped) % size, static_cast<float>(position - whole)};
}

/// Advances the horizon by a row: horizon[k] = max(horizon[k] - drop, height at k + shift), heights interpolated.
GLINT_MULTIVERSION void advance(const float* row, int size, Shift shift, float drop, float* horizon) {
  const auto part = [&](int first, int last, const float* from) {
    for (int k = first; k < last; ++k) horizon[k] = std::max(horizon[k] - drop, from[k] + shift.part * (from[k + 1] - from[k]));
  };
  part(0, size - shift.whole, row + shift.whole);
  part(size - shift.whole, size, row + shift.whole - size);
  horizon[size] = horizon[0];
}

/// What lies ahead of a row of points: the nearest row of heights, and the horizon of all rows beyond it. The shifts say where
/// a point looks over each.
struct Ahead {
  const float* row;
  Shift on_row;
  const float* horizon;
  Shift on_horizon;
  float drop;  ///< how much the line of sight falls from the horizon's row to the nearest row
};

/// Sets `bit` of words[k] where height[k] + rise is above both the nearest row and the horizon. The nearest row is taken
/// exactly where the point looks over it; only the horizon, farther away, is interpolated between lines.
GLINT_MULTIVERSION void compare(const float* height, const Ahead& ahead, int size, float rise, std::uint32_t bit,
                                std::uint32_t* words) {
  const float row_part = ahead.on_row.part, horizon_part = ahead.on_horizon.part, drop = ahead.drop;
  // Both shifts wrap somewhere, so the row is cut into three stretches without a seam.
  const int seam_row = size - ahead.on_row.whole, seam_horizon = size - ahead.on_horizon.whole;
  const int seams[4] = {0, std::min(seam_row, seam_horizon), std::max(seam_row, seam_horizon), size};
  for (int stretch = 0; stretch < 3; ++stretch) {
    const int first = seams[stretch], last = seams[stretch + 1];
    const float* row = ahead.row + ahead.on_row.whole - (first >= seam_row ? size : 0);
    const float* horizon = ahead.horizon + ahead.on_horizon.whole - (first >= seam_horizon ? size : 0);
    for (int k = first; k < last; ++k) {
      const float near = row[k] + row_part * (row[k + 1] - row[k]);
      const float far = horizon[k] + horizon_part * (horizon[k + 1] - horizon[k]) - drop;
      words[k] |= height[k] + rise >= std::max(near, far) ? bit : 0u;
    }
  }
}

/// The sweep of one direction along the major axis.
struct Sweep {
  double drift = 0;  ///< cells along the minor axis for each cell along the major axis, signed
  float rise = 0;    ///< cells of height for each cell along the major axis, > 0
  int reach = 0;     ///< cells beyond the map from which the highest vertex can still hide the lowest
  std::vector<float> horizon;
};

/// Sweeps up to 16 directions of one sector together. Calls store(cell along the major axis, facet of the cell (0 or 1), words)
/// with one word of bits for each cell along the minor axis.
template <class Store>
void sweepBatch(const Orientation& o, bool positive, std::vector<Sweep>& sweeps, const Store& store) {
  int reach = 0;
  for (Sweep& sweep : sweeps) {
    sweep.horizon.assign(static_cast<std::size_t>(o.minor) + 1, kLowest);
    reach = std::max(reach, sweep.reach);
  }
  std::vector<std::uint32_t> words(static_cast<std::size_t>(o.minor));
  // A line of sight keeps its number while it drifts along the minor axis: line k is at k + drift * step.
  for (int n = -reach; n <= o.major; ++n) {
    const int step = positive ? o.major - n : n - 1;  // from far ahead back to the map
    const int wrapped = ((step % o.major) + o.major) % o.major;
    const float* row = &o.rows[static_cast<std::size_t>(wrapped) * (o.minor + 1)];
    const int cell = positive ? step - 1 : step;  // the cell whose far side the lines are about to reach
    for (int half = 0; half < 2 && cell >= 0 && cell < o.major; ++half) {
      const double inside = half == 0 ? 1.0 / 3 : 2.0 / 3;
      const double distance = positive ? 1 - inside : inside;
      std::fill(words.begin(), words.end(), 0u);
      for (std::size_t s = 0; s < sweeps.size(); ++s) {
        const Sweep& sweep = sweeps[s];
        const double place = inside + sweep.drift * (positive ? distance : -distance);
        const Ahead ahead = {row, shiftOf(place, o.minor), sweep.horizon.data(), shiftOf(place - sweep.drift * step, o.minor),
                             sweep.rise};
        compare(&o.centroids[half][static_cast<std::size_t>(cell) * o.minor], ahead, o.minor,
                static_cast<float>(sweep.rise * distance), 1u << s, words.data());
      }
      store(cell, half, words.data());
    }
    for (Sweep& sweep : sweeps)
      if (n >= -sweep.reach) advance(row, o.minor, shiftOf(sweep.drift * step, o.minor), sweep.rise, sweep.horizon.data());
  }
}

/// Directions that one task sweeps: all in the same sector.
struct Batch {
  bool along_x;
  bool positive;
  std::vector<std::size_t> directions;
};

/// Sorts directions into four sectors, by their longer axis and its sign, and cuts each sector into batches.
std::vector<Batch> makeBatches(std::span<const Vec3> directions) {
  std::vector<Batch> batches;
  for (int sector = 0; sector < 4; ++sector) {
    const bool along_x = sector < 2, positive = sector % 2 == 0;
    int in_batch = kBatch;
    for (std::size_t d = 0; d < directions.size(); ++d) {
      const Vec3 w = directions[d];
      const bool is_x = std::abs(w.x) >= std::abs(w.y);
      if (is_x != along_x || ((is_x ? w.x : w.y) >= 0) != positive) continue;
      if (in_batch == kBatch) batches.push_back({along_x, positive, {}}), in_batch = 0;
      batches.back().directions.push_back(d);
      ++in_batch;
    }
  }
  return batches;
}

/// @param relief  difference of the largest and the smallest height
Sweep makeSweep(Vec3 direction, bool along_x, float relief) {
  const double major = std::max(1e-6, static_cast<double>(std::abs(along_x ? direction.x : direction.y)));
  const double signed_major = (along_x ? direction.x : direction.y) < 0 ? -major : major;
  Sweep sweep;
  sweep.drift = (along_x ? direction.y : direction.x) / signed_major;
  sweep.rise = static_cast<float>(direction.z / major);
  sweep.reach = static_cast<int>(std::ceil(relief / sweep.rise)) + 1;
  return sweep;
}

}  // namespace

VisibilityMasks::VisibilityMasks(const HeightSurface& surface, std::span<const Vec3> directions) : place_(directions.size()) {
  const std::vector<Batch> batches = makeBatches(directions);
  slots_ = batches.size();
  bits_.resize(surface.facetCount() * slots_);
  const auto [low, high] = std::minmax_element(surface.heights().begin(), surface.heights().end());
  const float relief = *high - *low;
  const Orientation orientations[2] = {orient(surface, false), orient(surface, true)};
  for (std::size_t slot = 0; slot < batches.size(); ++slot) {
    const auto& members = batches[slot].directions;
    for (std::size_t k = 0; k < members.size(); ++k) place_[members[k]] = static_cast<std::uint16_t>(slot * kBatch + k);
  }
  tbb::parallel_for(
      std::size_t{0}, batches.size(),
      [&](std::size_t slot) {
        const Batch& batch = batches[slot];
        const Orientation& o = orientations[batch.along_x];
        std::vector<Sweep> sweeps;
        for (const std::size_t d : batch.directions) sweeps.push_back(makeSweep(directions[d], batch.along_x, relief));
        sweepBatch(o, batch.positive, sweeps, [&](int cell, int half, const std::uint32_t* words) {
          const std::size_t first = static_cast<std::size_t>(cell) * o.major_step;
          for (int k = 0; k < o.minor; ++k) {
            const std::size_t facet = 2 * (first + static_cast<std::size_t>(k) * o.minor_step) + static_cast<std::size_t>(half);
            bits_[facet * slots_ + slot] = static_cast<std::uint16_t>(words[k]);
          }
        });
      },
      tbb::simple_partitioner());
}

}  // namespace glint::bake
