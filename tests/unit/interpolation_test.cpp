// Answers of pyramids between the centres and the sizes of their images, compared with the footprint that is asked for.
#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <numbers>
#include <random>
#include <string>
#include <vector>

#include "glint/bake/common/reference_image.h"
#include "glint/bake/common/seen_error.h"
#include "glint/bake/compressed/compress.h"
#include "glint/bake/pyramid/pyramid.h"
#include "glint/query/cp_ndf.h"
#include "glint/query/manifold_ndf.h"
#include "glint/query/pyramid_ndf.h"
#include "glint/query/reference.h"
#include "support/test_maps.h"

namespace glint::interpolation_test {
namespace {

using bake::SynthKind;
using test::OwnedMap;

/// A sum of round Gaussian footprints.
struct Gaussians {
  struct One {
    double share, x, y, variance;  // texels
  };
  std::vector<One> parts;
};

/// Integral of the product of two sums of Gaussians.
double product(const Gaussians& a, const Gaussians& b) {
  double sum = 0;
  for (const auto& p : a.parts) {
    for (const auto& q : b.parts) {
      const double variance = p.variance + q.variance, x = p.x - q.x, y = p.y - q.y;
      sum += p.share * q.share * std::exp(-(x * x + y * y) / (2 * variance)) / (2 * std::numbers::pi * variance);
    }
  }
  return sum;
}

/// ||a - b|| / ||b||: the seen error of a map of unrelated facets.
double relativeDistance(const Gaussians& a, const Gaussians& b) {
  const double norm = product(b, b);
  return std::sqrt(std::max(0.0, product(a, a) - 2 * product(a, b) + norm) / norm);
}

/// Footprints of a pyramid of a large map, and the footprint that its images see together.
class SeenFootprints {
 public:
  static constexpr int kSize = 1 << 14;

  explicit SeenFootprints(float overlap, Interpolation interpolation = Interpolation::footprint)
      : shape_(shapeOf(overlap)), chooser_(shape_, interpolation) {}

  float finest() const { return finestSigma(shape_); }

  Gaussians seen(Vec2 texel, float sigma) const {
    const PyramidSlices chosen = chooser_.choose(Footprint::isotropic({texel.x / kSize, texel.y / kSize}, sigma));
    Gaussians sum;
    for (int k = 0; k < chosen.count; ++k) {
      const PyramidSlice slice = chosen[k];
      const PyramidGrid& grid = shape_.levels[slice.level];
      const auto columns = static_cast<std::uint32_t>(grid.columns);
      const Vec2 at =
          shape_.centre(slice.level, static_cast<int>(slice.image % columns), static_cast<int>(slice.image / columns));
      const double own = double{kFootprintPerStride} * grid.stride;
      if (slice.weight > 0) sum.parts.push_back({slice.weight, at.x, at.y, own * own});
    }
    return sum;
  }

  /// Root mean square over places of error(place).
  template <class Error>
  double overPlaces(Error&& error) const {
    constexpr int kPlaces = 32;
    constexpr float kSpread = 500;  // texels, in the middle of the map
    double sum = 0;
    for (int k = 0; k < kPlaces; ++k) {  // the R2 sequence fills the square evenly
      const auto index = static_cast<float>(k);
      const Vec2 unit = {std::fmod(0.7548777f * index, 1.0f), std::fmod(0.5698403f * index, 1.0f)};
      const double e = error(Vec2{0.5f * kSize, 0.5f * kSize} + kSpread * unit);
      sum += e * e;
    }
    return std::sqrt(sum / kPlaces);
  }

  double error(float sigma) const {
    return overPlaces([&](Vec2 at) { return relativeDistance(seen(at, sigma), asked(at, sigma)); });
  }
  /// Change for 1 % in size.
  double step(float sigma) const {
    return overPlaces([&](Vec2 at) { return relativeDistance(seen(at, 1.01f * sigma), seen(at, sigma)); });
  }

  static Gaussians asked(Vec2 at, float sigma) { return {{{1, at.x, at.y, double{sigma} * sigma}}}; }

 private:
  static PyramidShape shapeOf(float overlap) {
    bake::PyramidOptions o;
    o.overlap = overlap;
    return bake::pyramidShape(kSize, kSize, o);
  }

  PyramidShape shape_;
  SliceChooser chooser_;
};

TEST(Interpolation, SeesTheFootprintThatIsAskedFor) {
  // At the size of level 0 there is no smaller image that a footprint could be made of.
  constexpr double kAtLevel0 = 0.28, kAbove = 0.17, kOnAverage = 0.1;
  constexpr float kFirst = 1.2f;  // in deviations of level 0
  const SeenFootprints footprints(bake::kDefaultOverlap);
  EXPECT_LT(footprints.error(footprints.finest()), kAtLevel0);
  double squares = 0;
  int sizes = 0;
  for (float size = kFirst; size < 8 * kFirst; size *= 1.06f, ++sizes) {
    const double error = footprints.error(size * footprints.finest());
    EXPECT_LT(error, kAbove) << size;
    squares += error * error;
  }
  EXPECT_LT(std::sqrt(squares / sizes), kOnAverage);
}

TEST(Interpolation, OfTheGridOfOneStrideErrsByLessThanHalfOfTheTrilinear) {
  const SeenFootprints trilinear(1, Interpolation::trilinear), footprints(1);
  double squares = 0, trilinear_squares = 0;
  for (float size = 2; size < 8; size *= 1.1f) {
    squares += std::pow(footprints.error(size * footprints.finest()), 2);
    trilinear_squares += std::pow(trilinear.error(size * footprints.finest()), 2);
  }
  EXPECT_LT(std::sqrt(squares), 0.5 * std::sqrt(trilinear_squares));
}

TEST(Interpolation, IsContinuousInSize) {
  constexpr double kMost = 0.03;  // the footprint that is asked for changes by sqrt(2) % itself
  for (const float overlap : {1.0f, bake::kDefaultOverlap}) {
    const SeenFootprints footprints(overlap);
    for (float size = 0.5f; size < 6; size *= 1.025f)
      ASSERT_LT(footprints.step(size * footprints.finest()), kMost) << overlap << ' ' << size;
  }
}

TEST(Interpolation, IsContinuousInPlaceWhereTheWindowMovesOn) {
  constexpr float kStep = 0.02f;  // texels
  // A kernel changes by less than 4 in a gap of at least 22 texels; neighbouring images differ by less than their size.
  constexpr double kMostStep = 4 * kStep / 22;
  const SeenFootprints footprints(bake::kDefaultOverlap);
  for (const float size : {1.0f, 1.6f, 2.1f}) {
    const float sigma = size * footprints.finest();
    const float start = 0.5f * SeenFootprints::kSize;
    Gaussians last = footprints.seen({start, start}, sigma);
    for (float x = start; x < start + 24; x += kStep) {
      Gaussians next = footprints.seen({x, start}, sigma);
      ASSERT_LT(relativeDistance(next, last), kMostStep) << size << ' ' << x - start;
      last = std::move(next);
    }
  }
}

/// Seen error of a model at random places.
template <class Model>
double seenError(const Model& model, const NormalMap& map, float sigma) {
  constexpr int kPlaces = 32, kResolution = 256;
  std::mt19937 random(5);
  std::uniform_real_distribution<float> unit(0, 1);
  bake::SeenError error(kResolution);
  for (int k = 0; k < kPlaces; ++k) {
    const Footprint p = Footprint::isotropic({unit(random), unit(random)}, sigma);
    const std::vector<float> image = test::imageOf(model, p, kResolution),
                             truth = bake::referenceImage(map, model.shape().sigma_r, Surface::flat, Boundary::wrap, p,
                                                          kResolution);
    error.add(image.data(), truth.data());
  }
  return error.summary().seen;
}

struct SynthCase {
  const char* name;
  SynthKind kind;
};
constexpr SynthCase kSynthCases[] = {
    {"flakes", SynthKind::flakes}, {"isotropic", SynthKind::isotropic}, {"brushed", SynthKind::brushed}};

TEST(Interpolation, SeenErrorAtRandomPlacesIsSmall) {
  // The target is 0.15; 32 places of flakes leave some noise.
  constexpr double kMostSeen = 0.17, kOfTrilinear = 0.6;
  constexpr int kSize = 256;
  for (const SynthCase& c : kSynthCases) {
    bake::SynthOptions synth = bake::defaultSynthOptions(c.kind);
    synth.width = synth.height = kSize;
    const OwnedMap owned(kSize, kSize, bake::synthNormals(synth));
    bake::PyramidOptions o;
    o.stride = 16;
    const bake::NdfPyramidData data = bake::buildPyramid(owned.map(), o);
    const PyramidNdf model(data.view()), trilinear(data.view(), Interpolation::trilinear);
    for (const float sigma : {9.0f, 16.5f}) {
      const double seen = seenError(model, owned.map(), sigma), plain = seenError(trilinear, owned.map(), sigma);
      std::printf("%s sigma %.1f: seen %.3f, trilinear %.3f\n", c.name, sigma, seen, plain);
      EXPECT_LT(seen, kMostSeen) << c.name << ' ' << sigma;
      EXPECT_LT(seen, kOfTrilinear * plain) << c.name << ' ' << sigma;
    }
  }
}

/// A map of 96 x 64 unrelated normals, and its pyramid.
struct SmallCase {
  OwnedMap owned{96, 64, test::randomNormals(96, 64, 0.4f, 7)};
  bake::NdfPyramidData data;

  explicit SmallCase(Boundary boundary = Boundary::wrap, float overlap = bake::kDefaultOverlap) {
    bake::PyramidOptions o;
    o.stride = 8;
    o.resolution = 64;
    o.sigma_r = 0.03f;
    o.boundary = boundary;
    o.overlap = overlap;
    data = bake::buildPyramid(owned.map(), o);
  }
};

/// The means over 16 x 16 squares of half vectors.
template <class Model>
std::vector<float> meansOf(const Model& model, const Footprint& p) {
  constexpr int kSquares = 16;
  std::vector<float> means;
  for (int y = 0; y < kSquares; ++y)
    for (int x = 0; x < kSquares; ++x) {
      const Vec2 low = {2.0f * static_cast<float>(x) / kSquares - 1, 2.0f * static_cast<float>(y) / kSquares - 1};
      means.push_back(model.mean(p, {low, low + Vec2{2.0f / kSquares, 2.0f / kSquares}}));
    }
  return means;
}

TEST(TexelBlend, AChangeOfOnePercentInSizeChangesLittleAtEverySize) {
  constexpr double kMostStep = 0.03;  // root mean square over half vectors and places
  constexpr int kPlaces = 4;
  for (const float overlap : {1.0f, bake::kDefaultOverlap}) {
    const SmallCase c(Boundary::wrap, overlap);
    const PyramidNdf model(c.data.view(), c.owned.map());
    for (float sigma = 2; sigma<10 * 96; sigma *= sigma> 3 && sigma < 12 ? 1.05f : 1.25f) {
      double difference = 0, norm = 0;
      std::mt19937 random(11);
      std::uniform_real_distribution<float> unit(0, 1);
      for (int k = 0; k < kPlaces; ++k) {
        const Vec2 uv = {unit(random), unit(random)};
        const auto a = meansOf(model, Footprint::isotropic(uv, sigma));
        const auto b = meansOf(model, Footprint::isotropic(uv, 1.01f * sigma));
        for (std::size_t i = 0; i < a.size(); ++i) {
          difference += std::pow(b[i] - a[i], 2);
          norm += std::pow(a[i], 2);
        }
      }
      ASSERT_LT(std::sqrt(difference / norm), kMostStep) << "overlap " << overlap << " sigma " << sigma;
    }
  }
}

/// Sizes inside the blend of texels and level 0: 1 to 1.2 times the footprints of level 0.
constexpr float kBlended[] = {1.01f, 1.05f, 1.1f, 1.15f, 1.19f};

template <class Model>
void expectPartsAgree(const Model& model, const Model& images, const ManifoldNdf& texels) {
  std::mt19937 random(13);
  std::uniform_real_distribution<float> unit(0, 1);
  for (const float size : kBlended) {
    for (int k = 0; k < 20; ++k) {
      const Footprint p = Footprint::isotropic({unit(random), unit(random)}, size * finestSigma(model.shape()));
      const Vec2 h = {unit(random) - 0.5f, unit(random) - 0.5f};
      const Box2 range = {h, h + Vec2{0.1f, 0.07f}};
      EXPECT_TRUE(model.fromTexels(p));
      const auto between = [&](float value, float a, float b) {
        const float rounding = 1e-5f * (a + b);
        return value >= std::min(a, b) - rounding && value <= std::max(a, b) + rounding;
      };
      EXPECT_TRUE(between(model.density(p, h), texels.density(p, h), images.density(p, h)));
      EXPECT_TRUE(between(model.mean(p, range), texels.mean(p, range), images.mean(p, range)));
      const HalfVectorSample s = model.sample(p, {unit(random), unit(random)});
      EXPECT_NEAR(s.pdf, model.density(p, s.h), 1e-4f * s.pdf + 1e-6f);
      EXPECT_NEAR(model.mean(p, {{-1, -1}, {1, 1}}), 0.25f, 3e-4f + 0.25f * ManifoldNdf::kLoss);
    }
  }
}

TEST(TexelBlend, DensityMeanAndSampleAgree) {
  for (const Boundary boundary : {Boundary::wrap, Boundary::clamp}) {
    const SmallCase c(boundary);
    const ManifoldNdf texels(c.owned.map(), 0.03f, Surface::flat, boundary);
    expectPartsAgree(PyramidNdf(c.data.view(), c.owned.map()), PyramidNdf(c.data.view()), texels);
    bake::CompressionOptions o;
    o.method = CompressionMethod::tucker;
    o.rank = 16;
    const auto compressed = bake::compressPyramid(c.data.view(), o);
    expectPartsAgree(CpNdf(compressed.view(), c.owned.map()), CpNdf(compressed.view()), texels);
  }
}

TEST(TexelBlend, SamplesFollowTheDensity) {
  constexpr int kSamples = 40000, kSquares = 8;
  const SmallCase c;
  const PyramidNdf model(c.data.view(), c.owned.map());
  const Footprint p = Footprint::isotropic({0.3f, 0.6f}, 1.1f * finestSigma(model.shape()));
  std::vector<double> counts(kSquares * kSquares, 0.0);
  std::mt19937 random(17);
  std::uniform_real_distribution<float> unit(0, 1);
  const auto squareOf = [](float x) { return std::clamp(static_cast<int>((x + 1) / 2 * kSquares), 0, kSquares - 1); };
  for (int k = 0; k < kSamples; ++k) {
    const HalfVectorSample s = model.sample(p, {unit(random), unit(random)});
    if (s.pdf > 0) ++counts[static_cast<std::size_t>(squareOf(s.h.y) * kSquares + squareOf(s.h.x))];
  }
  for (int y = 0; y < kSquares; ++y) {
    for (int x = 0; x < kSquares; ++x) {
      const Vec2 low = {-1 + 2.0f * static_cast<float>(x) / kSquares, -1 + 2.0f * static_cast<float>(y) / kSquares};
      const double area = 4.0 / (kSquares * kSquares);
      const double expected = kSamples * area * model.mean(p, {low, low + Vec2{2.0f / kSquares, 2.0f / kSquares}});
      // Five deviations of a count.
      EXPECT_NEAR(counts[static_cast<std::size_t>(y * kSquares + x)], expected, 5 * std::sqrt(expected + 1)) << x << ' ' << y;
    }
  }
}

TEST(TexelBlend, SaysWhichFootprintsAreAnsweredAsSuch) {
  const SmallCase c;
  const PyramidNdf images(c.data.view()), both(c.data.view(), c.owned.map());
  EXPECT_NEAR(images.smallestSigma(), 1.2f * finestSigma(c.data.shape), 0.01f);
  EXPECT_EQ(both.smallestSigma(), 0);
  EXPECT_FALSE(images.fromTexels(Footprint::isotropic({0.5f, 0.5f}, 1)));
  EXPECT_TRUE(both.fromTexels(Footprint::isotropic({0.5f, 0.5f}, 1)));
  EXPECT_FALSE(both.fromTexels(Footprint::isotropic({0.5f, 0.5f}, 1.3f * finestSigma(c.data.shape))));
}

TEST(Interpolation, AnswersAMapThatEndsNearItsBorder) {
  constexpr double kBorderError = 0.1;
  const SmallCase c(Boundary::clamp);
  const PyramidNdf model(c.data.view());
  const Reference texels(c.owned.map(), 0.03f, Surface::flat, Boundary::clamp, Reference::Search::pruned);
  double difference = 0, norm = 0;
  for (const Vec2 uv : {Vec2{0.001f, 0.4f}, {0.03f, 0.02f}, {0.98f, 0.5f}, {0.5f, 0.999f}, {0.999f, 0.999f}, {0.05f, 0.9f}}) {
    for (const float size : {1.3f, 1.6f, 2.2f}) {
      const Footprint p = Footprint::isotropic(uv, size * finestSigma(model.shape()));
      const auto a = meansOf(model, p), b = meansOf(texels, p);
      for (std::size_t i = 0; i < a.size(); ++i) {
        difference += std::pow(a[i] - b[i], 2);
        norm += std::pow(b[i], 2);
      }
    }
  }
  EXPECT_LT(std::sqrt(difference / norm), kBorderError);
}

}  // namespace
}  // namespace glint::interpolation_test
