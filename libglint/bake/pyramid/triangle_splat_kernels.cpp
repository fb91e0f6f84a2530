#include "glint/bake/pyramid/triangle_splat_kernels.h"

#include <algorithm>
#include <cmath>

#undef HWY_TARGET_INCLUDE
#define HWY_TARGET_INCLUDE "glint/bake/pyramid/triangle_splat_kernels.cpp"
#include <hwy/foreach_target.h>
#include <hwy/highway.h>

HWY_BEFORE_NAMESPACE();
namespace glint::bake::HWY_NAMESPACE {
namespace hn = hwy::HWY_NAMESPACE;

constexpr int kTaps = 4;  // number of bins along either axis that a point is added to
using Wide = hn::CappedTag<float, kTaps * kMoments>;
using Quad = hn::CappedTag<float, kTaps>;
constexpr int kLanes = static_cast<int>(hn::MaxLanes(Wide()));
static_assert(kLanes % kMoments == 0);

// Cubic B-spline weights of the bins around a point, as polynomials of its position between the middle two bins:
// kSpline[power][bin], and the same with each bin repeated for every moment.
#define GLINT_REPEATED(a, b, c, d) \
  { a, a, a, a, b, b, b, b, c, c, c, c, d, d, d, d }
HWY_ALIGN constexpr float kSpline[4][kTaps] = {
    {1.0f / 6, 4.0f / 6, 1.0f / 6, 0}, {-0.5f, 0, 0.5f, 0}, {0.5f, -1, 0.5f, 0}, {-1.0f / 6, 0.5f, -0.5f, 1.0f / 6}};
HWY_ALIGN constexpr float kSplineOfMoments[4][kTaps * kMoments] = {
    GLINT_REPEATED(1.0f / 6, 4.0f / 6, 1.0f / 6, 0), GLINT_REPEATED(-0.5f, 0, 0.5f, 0), GLINT_REPEATED(0.5f, -1, 0.5f, 0),
    GLINT_REPEATED(-1.0f / 6, 0.5f, -0.5f, 1.0f / 6)};
#undef GLINT_REPEATED

/// Evaluates the polynomials at x for a vector of bins.
template <class D>
HWY_INLINE hn::Vec<D> splineWeights(D d, const float* powers, int pitch, float x) {
  const auto v = hn::Set(d, x);
  const auto power = [&](int k) { return hn::LoadU(d, powers + k * pitch); };
  return hn::MulAdd(hn::MulAdd(hn::MulAdd(power(3), v, power(2)), v, power(1)), v, power(0));
}

HWY_INLINE void addPoint(Vec2 point, float share, const float* weights, const SplatRaster& raster) {
  constexpr int kTile = BlockBins::kTile;
  // Weights along y, times the share.
  const float x = point.x - 0.5f, y = point.y - 0.5f;
  const int ix = static_cast<int>(x), iy = static_cast<int>(y);
  const Quad quad;
  HWY_ALIGN float down[kTaps];
  const float fy = y - static_cast<float>(iy);
  for (int k = 0; k < kTaps; k += static_cast<int>(hn::Lanes(quad)))
    hn::Store(hn::Mul(hn::Set(quad, share), splineWeights(quad, kSpline[0] + k, kTaps, fy)), quad, down + k);
  // Weights along x, times the weights of moments; add their products to the bins.
  const Wide d;
  const float fx = x - static_cast<float>(ix);
  float* corner = raster.bins + (static_cast<std::size_t>(iy - 1) * raster.pitch + ix - 1) * kMoments;
  for (int k = 0; k < kTaps * kMoments; k += kLanes) {
    const auto across = hn::Mul(splineWeights(d, kSplineOfMoments[0] + k, kTaps * kMoments, fx), hn::LoadDup128(d, weights));
    float* row = corner + k;
    for (int dy = 0; dy < kTaps; ++dy, row += static_cast<std::size_t>(raster.pitch) * kMoments)
      hn::StoreU(hn::MulAdd(across, hn::Set(d, down[dy]), hn::LoadU(d, row)), d, row);
  }
  // Flag the tiles of the corners: the bins reach no other tile.
  const unsigned left = static_cast<unsigned>(ix - 1), bottom = static_cast<unsigned>(iy - 1);
  const unsigned first = left / kTile, last = (left + kTaps - 1) / kTile;
  std::uint8_t* lower = raster.touched + bottom / kTile * raster.tiles;
  std::uint8_t* upper = raster.touched + (bottom + kTaps - 1) / kTile * raster.tiles;
  lower[first] = lower[last] = upper[first] = upper[last] = 1;
}

/// A triangle along an axis from one corner to another: its width across the axis grows from 0 to 1 at `apex` and falls to 0
/// again. Positions along the axis are in [0, 1].
///
/// It is cut into slabs of equal thickness, each with its mass at its middle. The middles are moved and spread out a little,
/// and the widths are scaled, so that the mean and spread along the axis and the mean width are those of the triangle.
class Slabs {
 public:
  Slabs(float apex, int count) : apex_(apex), count_(count), thickness_(1 / static_cast<float>(count)) {
    const float mean = (1 + apex) / 3, variance = (1 - apex + apex * apex) / 18;
    float sum = 0, squares = 0, masses = 0;
    forEachMiddle([&](float t, float mass) { sum += mass * t, squares += mass * t * t, masses += mass * mass; });
    width_per_mass_ = 2 / (3 * masses);
    stretch_ = std::sqrt(variance / (squares - sum * sum));
    offset_ = mean - stretch_ * sum;
  }

  /// Calls visitor(position along the axis, relative width, share of the mass) for every slab.
  template <class Visitor>
  HWY_INLINE void forEach(Visitor&& visitor) const {
    forEachMiddle([&](float t, float mass) { visitor(offset_ + stretch_ * t, width_per_mass_ * mass, mass); });
  }

 private:
  template <class Visitor>
  HWY_INLINE void forEachMiddle(Visitor&& visitor) const {
    float mass_before = 0;
    for (int k = 0; k < count_; ++k) {
      const float t = (static_cast<float>(k) + 0.5f) * thickness_;
      const float mass_after = k + 1 < count_ ? massBelow(t + 0.5f * thickness_) : 1;
      visitor(t, mass_after - mass_before);
      mass_before = mass_after;
    }
  }
  float massBelow(float t) const { return t < apex_ ? t * t / apex_ : apex_ < 1 ? 1 - (1 - t) * (1 - t) / (1 - apex_) : 1; }

  float apex_;
  int count_;
  float thickness_, stretch_, offset_, width_per_mass_;
};

/// Number of slabs.
int slabsOf(float length, float piece) { return std::max(2, static_cast<int>(length / piece + 1)); }

void SplatPoint(Vec2 point, float share, const float* weights, const SplatRaster& raster) {
  addPoint(point, share, weights, raster);
}

void SplatColumns(const Vec2* p, float piece, const float* weights, const SplatRaster& raster) {
  const Vec2 base = p[1] - p[0], side = p[2] - p[0];
  const float squared = dot(base, base);
  const float apex = std::clamp(dot(side, base) / squared, 0.0f, 1.0f);  // where the third corner stands on the base
  const Vec2 rise = side - apex * base;                                  // from the base to the third corner
  const float height = std::sqrt(dot(rise, rise));
  Slabs(apex, slabsOf(std::sqrt(squared), piece)).forEach([&](float t, float relative_height, float mass) {
    const int pieces = static_cast<int>(relative_height * height / piece + 1);
    const float share = mass / static_cast<float>(pieces), step = relative_height / static_cast<float>(pieces);
    const Vec2 foot = p[0] + t * base;
    for (int k = 0; k < pieces; ++k) addPoint(foot + ((static_cast<float>(k) + 0.5f) * step) * rise, share, weights, raster);
  });
}

/// Integral of the cubic B-spline from 0 to t.
HWY_INLINE hn::Vec<Wide> splineIntegral(hn::Vec<Wide> t) {
  const Wide d;
  const auto a = hn::Min(hn::Abs(t), hn::Set(d, 2.0f)), b = hn::Sub(hn::Set(d, 2.0f), a), a2 = hn::Mul(a, a),
             b2 = hn::Mul(b, b);
  const auto inner = hn::Mul(a, hn::MulAdd(a2, hn::MulAdd(a, hn::Set(d, 0.125f), hn::Set(d, -1.0f / 3)), hn::Set(d, 2.0f / 3)));
  const auto outer = hn::NegMulAdd(hn::Mul(b2, b2), hn::Set(d, 1.0f / 24), hn::Set(d, 0.5f));
  return hn::CopySign(hn::IfThenElse(hn::Lt(a, hn::Set(d, 1.0f)), inner, outer), t);
}

/// Multiplies the sums of a patch by the weights of moments, adds the products to the raster, and clears the sums.
HWY_INLINE void movePatch(SplatPatch& patch, int rows, int pitch, int left, int bottom, const float* weights,
                          const SplatRaster& raster) {
  constexpr int kTile = BlockBins::kTile, kBins = kLanes / kMoments;
  const Wide d;
  HWY_ALIGN std::int32_t lanes[kLanes];
  for (int k = 0; k < kLanes; ++k) lanes[k] = k / kMoments;
  const auto repeated = hn::SetTableIndices(d, lanes);
  const auto moments = hn::LoadDup128(d, weights);
  for (int y = 0; y < rows; ++y) {
    SplatPatch::Span& span = patch.spans[y];
    float* sums = patch.sums.data() + static_cast<std::size_t>(y) * pitch;
    float* bins = raster.bins + (static_cast<std::size_t>(bottom + y) * raster.pitch + left) * kMoments;
    for (int x = span.begin; x < span.end; x += kBins) {
      const auto values = hn::TableLookupLanes(hn::LoadU(d, sums + x), repeated);
      hn::StoreU(hn::MulAdd(values, moments, hn::LoadU(d, bins + x * kMoments)), d, bins + x * kMoments);
    }
    for (int x = span.begin; x < span.end; x += kLanes) hn::StoreU(hn::Zero(d), d, sums + x);
    std::uint8_t* touched = raster.touched + (bottom + y) / kTile * raster.tiles;
    for (int tile = (left + span.begin) / kTile; tile <= (left + span.end - 1) / kTile; ++tile) touched[tile] = 1;
    span = {pitch, 0};
  }
}

void SplatRows(const Vec2* p, float piece, const float* weights, SplatPatch& patch, const SplatRaster& raster) {
  const auto [low, high] = std::minmax({p[0].x, p[1].x, p[2].x});
  const float height = p[2].y - p[0].y, apex = (p[1].y - p[0].y) / height;
  const float lean = p[2].x - p[0].x, width = p[1].x - (p[0].x + apex * lean);
  const Slabs slabs(apex, slabsOf(height, piece));
  // The bounding box with a margin: slabs move out by less than half a bin, and splines reach two bins farther.
  const int left = static_cast<int>(low) - 3, bottom = static_cast<int>(p[0].y) - 3;
  const int rows = static_cast<int>(p[2].y) + 4 - bottom, columns = static_cast<int>(high) + 4 - left;
  const int pitch = (columns + 2 * kLanes - 1) / kLanes * kLanes;
  const std::size_t size = static_cast<std::size_t>(rows) * pitch;
  if (patch.sums.size() < size) patch.sums.resize(size, 0.0f);
  if (patch.spans.size() < static_cast<std::size_t>(rows)) patch.spans.resize(rows);
  std::fill_n(patch.spans.begin(), rows, SplatPatch::Span{pitch, 0});
  // Add each slab as a segment along x.
  const Wide d;
  slabs.forEach([&](float t, float relative_width, float mass) {
    constexpr float kPoint = 0.01f;  // length, in bins, of the shortest segment: shorter ones give the same weights
    const float middle = p[0].x + t * lean + 0.5f * relative_width * width - static_cast<float>(left);
    const float half = 0.5f * std::max(std::fabs(relative_width * width), kPoint);
    const float y = p[0].y + t * height - 0.5f - static_cast<float>(bottom);
    const int iy = static_cast<int>(y);
    const float density = mass / (2 * half), fy = y - static_cast<float>(iy);
    float down[kTaps];
    for (int k = 0; k < kTaps; ++k)
      down[k] = density * (kSpline[0][k] + fy * (kSpline[1][k] + fy * (kSpline[2][k] + fy * kSpline[3][k])));
    // Integrate the spline over the segment for each bin that it reaches.
    const int begin = static_cast<int>(middle - half - 1.5f), end = static_cast<int>(middle + half + 2.5f);
    float* row = patch.sums.data() + static_cast<std::size_t>(iy - 1) * pitch;
    for (int x = begin; x < end; x += kLanes) {
      const auto centre = hn::Iota(d, static_cast<float>(x) + 0.5f - middle);
      const auto profile =
          hn::Sub(splineIntegral(hn::Add(centre, hn::Set(d, half))), splineIntegral(hn::Sub(centre, hn::Set(d, half))));
      for (int k = 0; k < kTaps; ++k) {
        float* sums = row + static_cast<std::size_t>(k) * pitch + x;
        hn::StoreU(hn::MulAdd(profile, hn::Set(d, down[k]), hn::LoadU(d, sums)), d, sums);
      }
    }
    for (int k = iy - 1; k < iy - 1 + kTaps; ++k)
      patch.spans[k] = {std::min(patch.spans[k].begin, begin), std::max(patch.spans[k].end, end)};
  });
  movePatch(patch, rows, pitch, left, bottom, weights, raster);
}

}  // namespace glint::bake::HWY_NAMESPACE
HWY_AFTER_NAMESPACE();

#if HWY_ONCE
namespace glint::bake {

HWY_EXPORT(SplatPoint);
HWY_EXPORT(SplatColumns);
HWY_EXPORT(SplatRows);

void splatPoint(Vec2 point, float share, const float weights[kMoments], const SplatRaster& raster) {
  HWY_DYNAMIC_DISPATCH(SplatPoint)(point, share, weights, raster);
}

void splatColumns(const Vec2 p[3], float piece, const float weights[kMoments], const SplatRaster& raster) {
  HWY_DYNAMIC_DISPATCH(SplatColumns)(p, piece, weights, raster);
}

void splatRows(const Vec2 p[3], float piece, const float weights[kMoments], SplatPatch& patch, const SplatRaster& raster) {
  HWY_DYNAMIC_DISPATCH(SplatRows)(p, piece, weights, patch, raster);
}

}  // namespace glint::bake
#endif
