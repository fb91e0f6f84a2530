#pragma once

#include <cstddef>
#include <span>
#include <vector>

#include "glint/bake/displace/effective_kernels.h"
#include "glint/query/brdf/base_table.h"

namespace glint::bake {

/// Nodes of one or more tables, each of [slices][nodes][nodes], in groups of four floats. Grey tables have a node and its
/// neighbours (x + 1, y), (x, y + 1), (x + 1, y + 1) in a group; coloured ones red, green, blue and 0. So a lookup is two
/// loads of a group, or eight.
class TableNodes {
 public:
  TableNodes() = default;
  /// @param values  [tables][slices][nodes][nodes][channels]
  TableNodes(std::span<const float> values, int slices, int nodes, int channels);

  bool grey() const { return channels_ == 1; }
  int slices() const { return slices_; }
  int nodes() const { return nodes_; }
  /// Nodes of one table.
  std::size_t size() const { return static_cast<std::size_t>(slices_) * nodes_ * nodes_; }
  const float* groups() const { return groups_.data(); }
  /// The value at a place of the first table.
  Rgb value(const TablePlace& place) const;

 private:
  int slices_ = 0, nodes_ = 0, channels_ = 1;
  std::vector<float> groups_;
};

/// Facets of a base that is a table, as arrays of `count` numbers each; count is a multiple of 8 and at most kMostTableFacets.
struct TableFacets {
  const float* x;  ///< x of the unit normals
  const float* y;
  const float* z;
  const float* masked;  ///< [directions][count]: root of the facet's weight, times its cosine where visible; else 0
  const float* colors;  ///< [count][4]: red, green, blue, 0; null: all 1
  std::size_t count;
};
inline constexpr std::size_t kMostTableFacets = 128;

/// c[channel][i][o] += sum over facets of masked[i] masked[o] f, times the facet's colour, for i <= o: light that facets reflect
/// once.
/// @param pairs     [directions][directions]
/// @param channels  of c: 1 for a grey table without colours, or 3
/// @param stride    floats from one row of c to the next
void addTablePairs(const TableNodes& table, const TableFacets& facets, std::span<const TablePair> pairs, std::size_t directions,
                   std::size_t channels, std::size_t stride, float* c);

/// out[channel][i] += scale visible[i] f(i, view) cos(i) of one facet, for light from every direction i.
/// @param out  [channels][padded directions]
void addTableLights(const TableNodes& table, const DirectionTable& directions, const float* visible, Vec3 normal, Vec3 view,
                    std::size_t channels, float scale, float* out);

/// Frames of all pairs of directions, as arrays.
struct PairFrames {
  PairFrames() = default;
  explicit PairFrames(const DirectionTable& directions);
  /// [directions][padded directions]: components of the half vector, of the vectors along and across, and the difference.
  std::vector<float> half[3], along[3], across[3], difference;
};

/// out[channel][i][o] += weights[channel] * tableLobe, for i <= o; padding may get other numbers.
/// @param tables  BaseTable::values
/// @param out     [channels][padded directions][padded directions]
void addTableLobe(const DirectionTable& directions, const PairFrames& frames, const TableNodes& tables, const VmfLobe& lobe,
                  std::span<const float> weights, float* out);

}  // namespace glint::bake
