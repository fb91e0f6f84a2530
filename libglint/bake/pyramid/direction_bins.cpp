#include "glint/bake/pyramid/direction_bins.h"

#include <algorithm>
#include <cmath>

#include "glint/bake/common/simd.h"
#include "glint/bake/pyramid/block_bins.h"
#include "glint/model/ndf_pyramid.h"

namespace glint::bake {

DirectionBins::DirectionBins(int resolution, int subdivision, int margin)
    : resolution_(resolution),
      subdivision_(subdivision),
      tiles_(resolution / (kBlockSize / 4)),
      margin_(margin),
      pitch_(resolution * subdivision + 2 * margin) {
  bins_.assign(static_cast<std::size_t>(pitch_) * pitch_, 0.0f);
  touched_.assign(static_cast<std::size_t>(tiles_) * tiles_, 0);
}

bool DirectionBins::touchedNear(int block_x, int block_y, int distance) const {
  const int reach = (distance + tileSize() - 1) / tileSize();
  const auto first = [&](int block) { return std::max(4 * block - reach, 0); };
  const auto last = [&](int block) { return std::min(4 * block + 4 + reach, tiles_); };
  for (int y = first(block_y); y < last(block_y); ++y) {
    const std::uint8_t* row = touched_.data() + static_cast<std::size_t>(y) * tiles_;
    if (std::any_of(row + first(block_x), row + last(block_x), [](std::uint8_t t) { return t != 0; })) return true;
  }
  return false;
}

template <class Visitor>
void DirectionBins::forEachTouchedRow(Visitor&& visitor) const {
  // A splat reaches one bin past the tile of its centre, so the neighbours of touched tiles are visited too. Bins outside the
  // square belong to the outermost tiles.
  const int size = tileSize();
  const auto begin = [&](int tile) { return tile == 0 ? -margin_ : tile * size; };
  const auto end = [&](int tile) { return tile == tiles_ - 1 ? pitch_ - margin_ : (tile + 1) * size; };
  std::vector<std::uint8_t> columns(tiles_);
  for (int ty = 0; ty < tiles_; ++ty) {
    std::fill(columns.begin(), columns.end(), std::uint8_t{0});
    for (int y = std::max(ty - 1, 0); y <= std::min(ty + 1, tiles_ - 1); ++y)
      for (int x = 0; x < tiles_; ++x) columns[x] |= touched_[static_cast<std::size_t>(y) * tiles_ + x];
    for (int tx = 0; tx < tiles_; ++tx) {
      if (!(columns[tx] || (tx > 0 && columns[tx - 1]) || (tx + 1 < tiles_ && columns[tx + 1]))) continue;
      for (int y = begin(ty); y < end(ty); ++y)
        visitor(static_cast<std::ptrdiff_t>(y) * pitch_ + begin(tx), end(tx) - begin(tx));
    }
  }
}

void DirectionBins::clear() {
  float* bins = origin();
  forEachTouchedRow([&](std::ptrdiff_t first, int count) { std::fill_n(bins + first, count, 0.0f); });
  std::fill(touched_.begin(), touched_.end(), std::uint8_t{0});
}

void DirectionBins::addTo(DirectionBins& other) const {
  const float* from = bins_.data() + static_cast<std::ptrdiff_t>(margin_) * pitch_ + margin_;
  float* to = other.origin();
  forEachTouchedRow([&](std::ptrdiff_t first, int count) {
    for (int k = 0; k < count; ++k) to[first + k] += from[first + k];
  });
  for (std::size_t k = 0; k < touched_.size(); ++k) other.touched_[k] |= touched_[k];
}

namespace {

/// Value of a B-spline at distance x from its middle.
double splineAt(Spline spline, double x) {
  x = std::fabs(x);
  const auto power = [](double v, int n) { return v <= 0 ? 0 : n == 2 ? v * v : v * v * v; };
  if (spline == Spline::quadratic) return 0.5 * power(1.5 - x, 2) - 1.5 * power(0.5 - x, 2);
  return (power(2 - x, 3) - 4 * power(1 - x, 3)) / 6;
}

/// Solves sum over s of gram(t - s) taps[s] = right[t], where gram are the inner products of shifted splines (values of the
/// spline of twice the order). The Gauss-Seidel iteration gains a digit in a few dozen sweeps.
std::vector<double> solveSplines(Spline spline, const std::vector<double>& right) {
  constexpr double kQuadratic[4] = {66.0 / 120, 26.0 / 120, 1.0 / 120, 0};
  constexpr double kCubic[4] = {2416.0 / 5040, 1191.0 / 5040, 120.0 / 5040, 1.0 / 5040};
  constexpr int kSweeps = 300;
  const double* gram = spline == Spline::quadratic ? kQuadratic : kCubic;
  const int n = static_cast<int>(right.size());
  std::vector<double> taps(right);
  for (int sweep = 0; sweep < kSweeps; ++sweep) {
    for (int t = 0; t < n; ++t) {
      double rest = right[t];
      for (int d = 1; d < 4; ++d) rest -= gram[d] * ((t >= d ? taps[t - d] : 0) + (t + d < n ? taps[t + d] : 0));
      taps[t] = rest / gram[0];
    }
  }
  return taps;
}

}  // namespace

PixelFilter::PixelFilter(float sigma_pixels, int subdivision, Spline spline) : subdivision_(subdivision) {
  const double bin = 1.0 / subdivision, sigma = sigma_pixels;
  radius_ = static_cast<int>(std::ceil(kFilterReach * sigma * subdivision));
  const auto cumulative = [&](double x) { return 0.5 * std::erf(x / (sigma * std::sqrt(2.0))); };
  // Share of a lobe in a pixel, for a facet x pixels from the left side of the pixel.
  const auto share = [&](double x) { return cumulative(1 - x) - cumulative(-x); };
  // Least squares over all positions of a facet: inner products of its share with the splines, by the midpoint rule.
  constexpr int kSteps = 64;  // points in a bin
  std::vector<double> right;
  for (int t = -radius_; t < subdivision + radius_; ++t) {
    double sum = 0;
    for (int k = 0; k < 4 * kSteps; ++k) {
      const double d = (k + 0.5) / kSteps - 2;
      sum += splineAt(spline, d) * share((t + 0.5 + d) * bin) / kSteps;
    }
    right.push_back(sum);
  }
  for (const double tap : solveSplines(spline, right)) taps_.push_back(static_cast<float>(tap));
  // A bin must give all of its mass: its shares in the pixels that it reaches, which are every subdivision-th tap, sum to 1.
  for (int phase = 0; phase < subdivision; ++phase) {
    double sum = 0;
    for (std::size_t t = phase; t < taps_.size(); t += subdivision) sum += taps_[t];
    for (std::size_t t = phase; t < taps_.size(); t += subdivision) taps_[t] = static_cast<float>(taps_[t] / sum);
  }
}

namespace {

/// Bins across the widest block: 16 pixels and the filter on either side, at the largest roughness and resolution (see
/// PyramidOptions).
constexpr int kMaxColumns = 2048;
/// Number of columns that are filtered at once. Their sums stay in registers.
constexpr int kStrip = 16;

/// rows[p][c] = sum over t of taps[t] * bins[p * step + t][c], for 16 rows p and `columns` columns c, a multiple of kStrip.
GLINT_MULTIVERSION void filterRows(const float* bins, int pitch, int step, const float* taps, int tap_count, int columns,
                                   float* rows) {
  for (int c = 0; c < columns; c += kStrip) {
    for (int p = 0; p < kBlockSize; ++p) {
      const float* in = bins + static_cast<std::ptrdiff_t>(p * step) * pitch + c;
      float sum[kStrip] = {};
      for (int t = 0; t < tap_count; ++t, in += pitch)
        for (int k = 0; k < kStrip; ++k) sum[k] += taps[t] * in[k];
      std::copy_n(sum, kStrip, rows + static_cast<std::size_t>(p) * columns + c);
    }
  }
}

/// pixels[p][x] += sum over t of taps[t] * rows[p][x * step + t]. Gathers every step-th value of a row first, so that vectors
/// of neighbouring pixels x load neighbouring values.
GLINT_MULTIVERSION void filterColumns(const float* rows, int columns, int step, const float* taps, int tap_count,
                                      float* pixels) {
  float phases[kMaxColumns + kBlockSize];
  const int phase_size = (columns + step - 1) / step;
  for (int p = 0; p < kBlockSize; ++p) {
    const float* row = rows + static_cast<std::size_t>(p) * columns;
    if (step == 2) {  // the usual step, a loop of which the compiler makes vectors
      for (int k = 0; k < columns / 2; ++k) phases[k] = row[2 * k], phases[phase_size + k] = row[2 * k + 1];
    } else {
      for (int phase = 0; phase < step; ++phase)
        for (int k = 0, c = phase; c < columns; ++k, c += step) phases[phase * phase_size + k] = row[c];
    }
    float sum[kBlockSize] = {};
    for (int t = 0; t < tap_count; ++t) {
      const float* in = phases + t % step * phase_size + t / step;
      for (int x = 0; x < kBlockSize; ++x) sum[x] += taps[t] * in[x];
    }
    for (int x = 0; x < kBlockSize; ++x) pixels[p * kBlockSize + x] += sum[x];
  }
}

}  // namespace

int PixelFilter::margin() const { return std::max(radius_, BlockBins::kTile) + 2 * kStrip; }

void PixelFilter::addBlock(const float* bins, int pitch, float* pixels) const {
  const int tap_count = static_cast<int>(taps_.size());
  const int columns = ((kBlockSize - 1) * subdivision_ + tap_count + kStrip - 1) / kStrip * kStrip;
  float rows[kBlockSize * kMaxColumns];
  const float* corner = bins - static_cast<std::ptrdiff_t>(radius_) * pitch - radius_;
  filterRows(corner, pitch, subdivision_, taps_.data(), tap_count, columns, rows);
  filterColumns(rows, columns, subdivision_, taps_.data(), tap_count, pixels);
}

int subdivisionFor(float sigma_pixels) {
  // Bins of 0.8 deviations keep images well within the 1 % rel_l2 of Reference that tests hold.
  return std::clamp(static_cast<int>(std::ceil(1 / (0.8f * sigma_pixels))), 1, 16);
}

}  // namespace glint::bake
