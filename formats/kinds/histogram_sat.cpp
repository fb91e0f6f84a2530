#include <algorithm>
#include <array>
#include <cmath>

#include "glint/formats/kinds/description.h"
#include "glint/formats/kinds/shared_fields.h"

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

template <>
struct KindDescription<HistogramSat> {
  static constexpr std::string_view kTitle = "Accumulated histograms of normals";

  static std::vector<Rule> indexRules() {
    return {errorRule("histogram.bins", "bin_ids increase, below theta_bins * phi_bins, which is at most 2048"),
            errorRule("histogram.strides", "coarse_stride is a multiple of stride"),
            errorRule("histogram.texels", "every texel's bin is below bin_count")};
  }
  static std::vector<Rule> valueRules() {
    return {errorRule("histogram.bin_normals", "the mean normals of bins lie inside the unit disk"),
            errorRule("histogram.bin_slopes", "slopes of bins are finite, and their covariances positive semi-definite"),
            errorRule("histogram.totals", "bin_totals are the numbers of texels of each bin, above 0"),
            errorRule("histogram.sums", "the tables of sums count the texels of each bin")};
  }

  static void describe(Fields auto& fields, auto& sat) {
    describeMapSize(fields, sat);
    fields.integer("theta_bins", sat.theta_bins, {1, HistogramSat::kMaxThetaBins}, "1", "rings of elevation");
    fields.integer("phi_bins", sat.phi_bins, {1, HistogramSat::kMaxPhiBins}, "1", "sectors of azimuth");
    fields.integer("bin_count", sat.bin_count, {1, HistogramSat::kMaxBins}, "1", "bins that occur");
    fields.integer("stride", sat.stride, {1, HistogramSat::kMaxStride}, "texel", "distance between the points of sums");
    fields.integer("coarse_stride", sat.coarse_stride, {1, HistogramSat::kMaxStride}, "texel",
                   "distance between the points of coarse_sums; a multiple of stride");
    fields.integer("line_stride", sat.line_stride, {1, HistogramSat::kMaxLineStride}, "texel",
                   "distance between the points of row_sums, column_sums");
    describeSlopes(fields, sat.slopes);
    fields.derived("row_length", "ceil_div(bin_count, 16) * 16", "counters of a point");
    fields.array("bin_ids", sat.bin_ids, {"bin_count"}, "1", "ring * phi_bins + sector of each bin that occurs, increasing");
    fields.array("bin_normals", sat.bin_normals, {"bin_count", "2"}, "1", "mean (nx, ny) of the texels of each bin");
    fields.array("bin_slopes", sat.bin_slopes, {"bin_count", "5"}, "1",
                 "slopes of the texels of each bin: mean along u and v, then uu, uv, vv of their covariance");
    fields.array("bin_totals", sat.bin_totals, {"bin_count"}, "1", "texels of each bin");
    fields.array("texels", sat.texels, {"ceil_div(height, 8)", "ceil_div(width, 8)", "8", "8"}, "1",
                 "bin of each texel, in tiles");
    fields.array("sums", sat.sums, {"ceil_div(height, stride) + 1", "ceil_div(width, stride) + 1", "row_length"}, "1",
                 "texels of each bin below and left of each point, modulo 2^16");
    fields.array("coarse_sums", sat.coarse_sums,
                 {"ceil_div(height, coarse_stride) + 1", "ceil_div(width, coarse_stride) + 1", "row_length"}, "1",
                 "texels of each bin below and left of each point, modulo 2^32");
    fields.array("row_sums", sat.row_sums, {"height", "ceil_div(width, line_stride) + 1", "row_length"}, "1",
                 "texels of each bin in a row left of each point, modulo 2^16");
    fields.array("column_sums", sat.column_sums, {"width", "ceil_div(height, line_stride) + 1", "row_length"}, "1",
                 "texels of each bin in a column below each point, modulo 2^16");
  }

  static void checkIndex(const HistogramSat& sat, Findings& findings) {
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

  static void checkValues(const HistogramSat& sat, Findings& findings) {
    const auto inside = [](Vec2 n) { return dot(n, n) < 1; };
    if (!std::all_of(sat.bin_normals.begin(), sat.bin_normals.end(), inside))
      findings.add("histogram.bin_normals", "/bin_normals", "are not all inside the unit disk");
    const auto usable = [](const MapSlopes& s) { return areUsable(s) && isCovariance(s.covariance); };
    if (!std::all_of(sat.bin_slopes.begin(), sat.bin_slopes.end(), usable))
      findings.add("histogram.bin_slopes", "/bin_slopes", "are not all finite means and covariances");
    if (!totalsCount(sat)) findings.add("histogram.totals", "/bin_totals", "are not the numbers of texels, all above 0");
    const auto check = [&](bool counts, const char* object) {
      if (!counts) findings.add("histogram.sums", object, "do not count the texels");
    };
    check(tableCounts(sat, sat.sums, sat.stride), "/sums");
    check(tableCounts(sat, sat.coarse_sums, sat.coarse_stride), "/coarse_sums");
    check(linesCount(sat, sat.row_sums, false), "/row_sums");
    check(linesCount(sat, sat.column_sums, true), "/column_sums");
  }
};

template const Kind& kindOf<HistogramSat>();

}  // namespace glint::formats
