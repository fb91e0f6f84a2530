#include <algorithm>
#include <array>
#include <cmath>

#include "glint/formats/kinds/pyramid_shape.h"

namespace glint::formats {
namespace {

std::uint64_t size(int n) { return static_cast<std::uint64_t>(n); }

/// Texel at a point of a table.
int texelOf(int point, int stride, int texels) {
  return static_cast<int>(std::min<std::int64_t>(std::int64_t{point} * stride, texels));
}

/// Numbers of texels in each bin of a small rectangle; counters beyond bin_count stay 0.
class CellCounts {
 public:
  explicit CellCounts(const HistogramSat& sat) : sat_(sat), counts_(static_cast<std::size_t>(sat.rowLength())) {}

  const std::vector<std::uint32_t>& count(int x0, int x1, int y0, int y1) {
    std::fill(counts_.begin(), counts_.end(), 0);
    for (int j = y0; j < y1; ++j)
      for (int i = x0; i < x1; ++i) ++counts_[sat_.texels[sat_.texelIndex(i, j)]];
    return counts_;
  }

 private:
  const HistogramSat& sat_;
  std::vector<std::uint32_t> counts_;
};

/// Whether every cell between neighbouring points of a table counts its texels, and the borders at 0 are 0.
template <class Counter>
bool tableCounts(const HistogramSat& sat, std::span<const Counter> table, int stride) {
  const auto length = static_cast<std::size_t>(sat.rowLength());
  const int columns = sat.pointsX(stride);
  const int rows = sat.pointsY(stride);
  const auto point = [&](int a, int b) { return &table[(size(b) * size(columns) + size(a)) * length]; };
  const auto zero = [&](const Counter* at) { return std::all_of(at, at + length, [](Counter c) { return c == 0; }); };
  for (int a = 0; a < columns; ++a)
    if (!zero(point(a, 0))) return false;
  CellCounts cell(sat);
  for (int b = 1; b < rows; ++b) {
    if (!zero(point(0, b))) return false;
    for (int a = 1; a < columns; ++a) {
      const std::vector<std::uint32_t>& counts = cell.count(texelOf(a - 1, stride, sat.width), texelOf(a, stride, sat.width),
                                                            texelOf(b - 1, stride, sat.height), texelOf(b, stride, sat.height));
      const std::array corners = {point(a, b), point(a - 1, b), point(a, b - 1), point(a - 1, b - 1)};
      for (std::size_t k = 0; k < length; ++k) {
        const auto held = static_cast<Counter>(corners[0][k] - corners[1][k] - corners[2][k] + corners[3][k]);
        if (held != static_cast<Counter>(counts[k])) return false;
      }
    }
  }
  return true;
}

/// The same for the sums along rows (or columns).
bool linesCount(const HistogramSat& sat, std::span<const std::uint16_t> table, bool columns) {
  const auto length = static_cast<std::size_t>(sat.rowLength());
  const int stride = sat.line_stride;
  const int points = columns ? sat.pointsY(stride) : sat.pointsX(stride);
  const int texels = columns ? sat.height : sat.width;
  CellCounts cell(sat);
  for (int line = 0; line < (columns ? sat.width : sat.height); ++line) {
    const std::uint16_t* here = &table[size(line) * size(points) * length];
    if (!std::all_of(here, here + length, [](std::uint16_t c) { return c == 0; })) return false;
    for (int a = 1; a < points; ++a, here += length) {
      const int begin = texelOf(a - 1, stride, texels);
      const int end = texelOf(a, stride, texels);
      const std::vector<std::uint32_t>& counts =
          columns ? cell.count(line, line + 1, begin, end) : cell.count(begin, end, line, line + 1);
      for (std::size_t k = 0; k < length; ++k)
        if (static_cast<std::uint16_t>(here[length + k] - here[k]) != static_cast<std::uint16_t>(counts[k])) return false;
    }
  }
  return true;
}

bool totalsCount(const HistogramSat& sat) {
  std::vector<std::uint64_t> counts(sat.bin_totals.size());
  for (int j = 0; j < sat.height; ++j)
    for (int i = 0; i < sat.width; ++i) ++counts[sat.texels[sat.texelIndex(i, j)]];
  return std::equal(counts.begin(), counts.end(), sat.bin_totals.begin()) &&
         std::find(counts.begin(), counts.end(), 0u) == counts.end();
}

}  // namespace

PackedAsset pack(const HistogramSat& sat) {
  PackedAsset packed{"histogram-sat", {}, {}};
  packed.integer("width", sat.width);
  packed.integer("height", sat.height);
  packed.integer("theta_bins", sat.theta_bins);
  packed.integer("phi_bins", sat.phi_bins);
  packed.integer("bin_count", sat.bin_count);
  packed.integer("stride", sat.stride);
  packed.integer("coarse_stride", sat.coarse_stride);
  packed.integer("line_stride", sat.line_stride);
  packSlopes(sat.slopes, packed);
  const std::uint64_t bins = size(sat.bin_count);
  const std::uint64_t length = size(sat.rowLength());
  const std::uint64_t tile = HistogramSat::kTileSize;
  const auto points_x = [&](int stride) { return size(sat.pointsX(stride)); };
  const auto points_y = [&](int stride) { return size(sat.pointsY(stride)); };
  packed.array("bin_ids", ElementType::u16, {bins}, sat.bin_ids.data(), sat.bin_ids.size());
  packed.array("bin_normals", ElementType::f32, {bins, 2}, sat.bin_normals.data(), sat.bin_normals.size() * 2);
  packed.array("bin_totals", ElementType::u64, {bins}, sat.bin_totals.data(), sat.bin_totals.size());
  packed.array("texels", ElementType::u16, {size(sat.tileRows()), size(sat.tileColumns()), tile, tile}, sat.texels.data(),
               sat.texels.size());
  packed.array("sums", ElementType::u16, {points_y(sat.stride), points_x(sat.stride), length}, sat.sums.data(),
               sat.sums.size());
  packed.array("coarse_sums", ElementType::u32, {points_y(sat.coarse_stride), points_x(sat.coarse_stride), length},
               sat.coarse_sums.data(), sat.coarse_sums.size());
  packed.array("row_sums", ElementType::u16, {size(sat.height), points_x(sat.line_stride), length}, sat.row_sums.data(),
               sat.row_sums.size());
  packed.array("column_sums", ElementType::u16, {size(sat.width), points_y(sat.line_stride), length}, sat.column_sums.data(),
               sat.column_sums.size());
  return packed;
}

void unpack(const Content& content, HistogramSat& sat) {
  sat.width = content.integer("width");
  sat.height = content.integer("height");
  sat.theta_bins = content.integer("theta_bins");
  sat.phi_bins = content.integer("phi_bins");
  sat.bin_count = content.integer("bin_count");
  sat.stride = content.integer("stride");
  sat.coarse_stride = content.integer("coarse_stride");
  sat.line_stride = content.integer("line_stride");
  sat.slopes = unpackSlopes(content);
  sat.bin_ids = content.array<std::uint16_t>("bin_ids");
  sat.bin_normals = content.array<Vec2>("bin_normals");
  sat.bin_totals = content.array<std::uint64_t>("bin_totals");
  sat.texels = content.array<std::uint16_t>("texels");
  sat.sums = content.array<std::uint16_t>("sums");
  sat.coarse_sums = content.array<std::uint32_t>("coarse_sums");
  sat.row_sums = content.array<std::uint16_t>("row_sums");
  sat.column_sums = content.array<std::uint16_t>("column_sums");
}

void checkIndex(const HistogramSat& sat, Findings& findings) {
  const int directions = sat.theta_bins * sat.phi_bins;
  bool increasing = directions <= HistogramSat::kMaxBins && sat.bin_ids.back() < directions;
  for (std::size_t k = 1; k < sat.bin_ids.size(); ++k) increasing &= sat.bin_ids[k - 1] < sat.bin_ids[k];
  if (!increasing) {
    findings.add("histogram.bins", "/bin_ids",
                 "are not increasing numbers below " + std::to_string(directions) + ", at most 2048 of them");
  }
  if (sat.coarse_stride % sat.stride != 0) {
    findings.add("histogram.strides", "/@coarse_stride",
                 "is " + std::to_string(sat.coarse_stride) + ", not a multiple of " + std::to_string(sat.stride));
  }
  const auto bins = static_cast<std::uint16_t>(sat.bin_count);
  const auto highest = std::max_element(sat.texels.begin(), sat.texels.end());
  if (*highest >= bins) {
    findings.add("histogram.texels", "/texels",
                 "name bin " + std::to_string(*highest) + " of " + std::to_string(sat.bin_count));
  }
  checkSlopes(sat.slopes, findings);
}

void checkData(const HistogramSat& sat, Findings& findings) {
  const auto inside = [](Vec2 n) { return dot(n, n) < 1; };
  if (!std::all_of(sat.bin_normals.begin(), sat.bin_normals.end(), inside))
    findings.add("histogram.bin_normals", "/bin_normals", "are not all inside the unit disk");
  if (!totalsCount(sat)) findings.add("histogram.totals", "/bin_totals", "are not the numbers of texels, all above 0");
  const auto check = [&](bool counts, const char* object) {
    if (!counts) findings.add("histogram.sums", object, "do not count the texels");
  };
  check(tableCounts(sat, sat.sums, sat.stride), "/sums");
  check(tableCounts(sat, sat.coarse_sums, sat.coarse_stride), "/coarse_sums");
  check(linesCount(sat, sat.row_sums, false), "/row_sums");
  check(linesCount(sat, sat.column_sums, true), "/column_sums");
}

}  // namespace glint::formats
