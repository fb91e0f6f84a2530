#pragma once

#include <cstddef>
#include <cstdint>
#include <span>

#include "glint/math/vec.h"
#include "glint/model/map_slopes.h"

namespace glint {

/// Accumulated histograms of the normals of a map over (theta, phi) bins (asset kind `histogram-sat`).
///
/// Normals are binned by elevation and azimuth in equal angles (Gamboa 2018, section 4.1): ring floor(theta / (pi/2) *
/// theta_bins), sector floor(phi / (2 pi) * phi_bins), phi = atan2(ny, nx) in [0, 2 pi). Only the bins that occur are kept: bin
/// k below is the k-th of them, in the order ring * phi_bins + sector.
///
/// Four tables count texels of each bin, one row of `rowLength()` counters after the other:
///  - `sums`: texels of [0, x) x [0, y) at every `stride` texels, modulo 2^16: exact differences for rectangles of less than
///    2^16 texels;
///  - `coarse_sums`: texels of [0, x) x [0, y) at every `coarse_stride` texels, modulo 2^32;
///  - `row_sums`, `column_sums`: texels of one row (column) before every `line_stride`-th texel, modulo 2^16.
/// Point a of a table lies at texel min(a * stride, size); the last one is the border. Counters beyond `bin_count` are 0.
struct HistogramSat {
  static constexpr int kMaxThetaBins = 64;
  static constexpr int kMaxPhiBins = 256;
  static constexpr int kMaxBins = 2048;   ///< theta_bins * phi_bins at most
  static constexpr int kMaxStride = 128;  ///< largest stride of `sums` and `coarse_sums`: a cell is far below 2^16 texels
  static constexpr int kMaxLineStride = 4096;
  static constexpr int kTileSize = 8;       ///< texels are stored in tiles, so that columns cost no more than rows
  static constexpr int kRowAlignment = 16;  ///< counters

  int width = 0;   ///< of the normal map, texels
  int height = 0;  ///< of the normal map, texels; width * height <= 2^32
  int theta_bins = 0;
  int phi_bins = 0;
  int bin_count = 0;      ///< bins that occur
  int stride = 0;         ///< texels, 1..kMaxStride
  int coarse_stride = 0;  ///< texels; a multiple of stride, at most kMaxStride
  int line_stride = 0;    ///< texels, 1..kMaxLineStride
  MapSlopes slopes;       ///< of the normal map's texels

  std::span<const std::uint16_t> bin_ids;      ///< [bin_count]: ring * phi_bins + sector, increasing
  std::span<const Vec2> bin_normals;           ///< [bin_count]: mean of (nx, ny) over the texels of a bin
  std::span<const MapSlopes> bin_slopes;       ///< [bin_count]: moments of the slopes of the texels of a bin
  std::span<const std::uint64_t> bin_totals;   ///< [bin_count]: texels of the map in a bin
  std::span<const std::uint16_t> texels;       ///< [tile rows][tile columns][8][8]: bin of each texel; 0 beyond the map
  std::span<const std::uint16_t> sums;         ///< [pointsY(stride)][pointsX(stride)][rowLength]
  std::span<const std::uint32_t> coarse_sums;  ///< [pointsY(coarse_stride)][pointsX(coarse_stride)][rowLength]
  std::span<const std::uint16_t> row_sums;     ///< [height][pointsX(line_stride)][rowLength]
  std::span<const std::uint16_t> column_sums;  ///< [width][pointsY(line_stride)][rowLength]

  /// Counters of one point of a table: bin_count rounded up.
  GLINT_HD constexpr int rowLength() const { return (bin_count + kRowAlignment - 1) / kRowAlignment * kRowAlignment; }
  GLINT_HD constexpr int tileColumns() const { return (width + kTileSize - 1) / kTileSize; }
  GLINT_HD constexpr int tileRows() const { return (height + kTileSize - 1) / kTileSize; }
  /// Points of a table of this stride along u and along v, points on both borders included.
  GLINT_HD constexpr int pointsX(int table_stride) const { return (width + table_stride - 1) / table_stride + 1; }
  GLINT_HD constexpr int pointsY(int table_stride) const { return (height + table_stride - 1) / table_stride + 1; }
  /// Index of a texel in `texels`.
  GLINT_HD constexpr std::size_t texelIndex(int i, int j) const {
    const std::size_t tile = rowMajorIndex(i / kTileSize, j / kTileSize, tileColumns());
    return tile * kTileSize * kTileSize + rowMajorIndex(i % kTileSize, j % kTileSize, kTileSize);
  }
};

}  // namespace glint
