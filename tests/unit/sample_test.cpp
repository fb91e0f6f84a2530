#include <gtest/gtest.h>

#include <algorithm>
#include <array>
#include <cmath>
#include <limits>
#include <memory>
#include <string>
#include <vector>

#include "glint/bake/bin_map/bin_map.h"
#include "glint/bake/common/counter_random.h"
#include "glint/bake/compressed/compress.h"
#include "glint/bake/histogram/histogram_sat.h"
#include "glint/bake/moments/slope_moments.h"
#include "glint/bake/pyramid/pyramid.h"
#include "glint/query/bin_map_ndf.h"
#include "glint/query/cp_ndf.h"
#include "glint/query/histogram_ndf.h"
#include "glint/query/manifold_ndf.h"
#include "glint/query/moments_ndf.h"
#include "glint/query/pyramid_ndf.h"
#include "glint/query/reference.h"
#include "support/test_maps.h"

namespace glint::sample_test {
namespace {

using bake::NdfCpData;
using bake::NdfPyramidData;
using bake::SynthKind;
using test::OwnedMap;

constexpr float kNan = std::numeric_limits<float>::quiet_NaN();
constexpr float kInfinity = std::numeric_limits<float>::infinity();
constexpr int kResolution = 64;
constexpr float kSigmaR = 0.02f;
constexpr int kFootprints = 20;
/// Chance that a right sampler fails any of the chi-squared tests of one TEST (Bonferroni: shared by its footprints).
constexpr double kFalseAlarm = 1e-3;

/// Upper regularised incomplete gamma function: Lentz's continued fraction, or one minus the series.
double gammaQ(double a, double x) {
  if (x <= 0) return 1;
  const double front = std::exp(a * std::log(x) - x - std::lgamma(a));
  if (x < a + 1) {
    double term = 1 / a, sum = term;
    for (int n = 1; n < 10000 && term > 1e-16 * sum; ++n) sum += term *= x / (a + n);
    return 1 - front * sum;
  }
  double b = x + 1 - a, c = 1e300, d = 1 / b, h = d;
  for (int n = 1; n < 10000; ++n) {
    const double an = -n * (n - a);
    b += 2;
    d = 1 / (an * d + b);
    c = b + an / c;
    h *= d * c;
    if (std::abs(d * c - 1) < 1e-14) break;
  }
  return front * h;
}

struct ChiSquared {
  double statistic = 0;
  int degrees = 0;
  double p() const { return degrees > 0 ? gammaQ(0.5 * degrees, 0.5 * statistic) : 1; }
};

/// Pearson's statistic, bins merged in order until each expects `least` samples. What is expected in no bin at all forms the
/// last one.
ChiSquared chiSquared(const std::vector<double>& expected, const std::vector<double>& observed, double total,
                      double least = 8) {
  ChiSquared result;
  double e = 0, o = 0, all_e = 0, all_o = 0;
  int bins = 0;
  const auto close = [&] {
    result.statistic += (o - e) * (o - e) / e;
    ++bins;
    e = o = 0;
  };
  for (std::size_t k = 0; k < expected.size(); ++k) {
    e += expected[k];
    o += observed[k];
    all_e += expected[k];
    all_o += observed[k];
    if (e >= least) close();
  }
  // Outside the square, and what was left over.
  e += total - all_e;
  o += total - all_o;
  if (e > 0.5 || o > 0.5) {
    e = std::max(e, 0.5);
    close();
  }
  result.degrees = bins - 1;
  return result;
}

TEST(ChiSquared, HasItsKnownQuantiles) {
  EXPECT_NEAR(gammaQ(0.5 * 1, 0.5 * 3.841459), 0.05, 1e-6);
  EXPECT_NEAR(gammaQ(0.5 * 10, 0.5 * 18.307038), 0.05, 1e-6);
  EXPECT_NEAR(gammaQ(0.5 * 100, 0.5 * 77.929465), 0.95, 1e-6);
  EXPECT_NEAR(gammaQ(0.5 * 1000, 0.5 * 1106.969), 0.01, 1e-5);
}

TEST(Gaussian, QuantileInvertsTheDistribution) {
  for (int k = 1; k < 4096; ++k) {
    const double u = k / 4096.0, q = normalQuantile(static_cast<float>(u));
    EXPECT_NEAR(0.5 * std::erfc(-q / std::sqrt(2.0)), u, 2e-7);
  }
  EXPECT_TRUE(std::isfinite(normalQuantile(0)));
  EXPECT_TRUE(std::isfinite(normalQuantile(0x1.fffffep-1f)));
}

struct Case {
  std::string name;
  OwnedMap map;
  NdfPyramidData pyramid;
};

const std::vector<std::unique_ptr<Case>>& cases() {
  static const auto built = [] {
    std::vector<std::unique_ptr<Case>> list;
    for (const auto& [name, kind] :
         {std::pair{"isotropic", SynthKind::isotropic}, {"flakes", SynthKind::flakes}, {"brushed", SynthKind::brushed}}) {
      list.push_back(std::unique_ptr<Case>(new Case{name, OwnedMap(96, 64, test::synthesised(kind, 96, 64, 0.25f)), {}}));
      bake::PyramidOptions o;
      o.stride = 16;
      o.resolution = kResolution;
      o.sigma_r = kSigmaR;
      o.levels = 3;
      list.back()->pyramid = bake::buildPyramid(list.back()->map.map(), o);
    }
    return list;
  }();
  return built;
}

NdfCpData compress(const Case& c, CompressionMethod method, CoefficientType type, int rank = 7) {
  bake::CompressionOptions o;
  o.method = method;
  o.coefficient_type = type;
  o.rank = rank;  // 7 leaves values below zero, and a rest of columns beyond a multiple of four
  o.metric = bake::ErrorMetric::l2;
  o.regions = 2;
  return bake::compressPyramid(c.pyramid.view(), o);
}

Footprint randomFootprint(std::uint64_t seed, int k, float low, float high) {
  const Vec2 a = bake::randomPair(seed, 1, k), b = bake::randomPair(seed, 2, k);
  return Footprint::isotropic(a, low * std::pow(high / low, b.x));
}

Box2 binBox(std::size_t bin) {
  const Vec2 centre = test::pixelCentre(bin, kResolution), half = {1.0f / kResolution, 1.0f / kResolution};
  return {centre - half, centre + half};
}

std::size_t binOf(Vec2 h) {
  const auto index = [](float x) { return std::clamp(static_cast<int>((x + 1) * (kResolution / 2)), 0, kResolution - 1); };
  return static_cast<std::size_t>(index(h.y) * kResolution + index(h.x));
}

using Histogram = std::vector<double>;

/// Counts samples in the pixels of an image; those with pdf 0 in none.
template <class Model>
Histogram histogramOf(const Model& model, const Footprint& p, int samples, std::uint64_t seed) {
  Histogram counts(kResolution * kResolution, 0.0);
  for (int k = 0; k < samples; ++k) {
    const HalfVectorSample s = model.sample(p, bake::randomPair(seed, 0, k));
    if (s.pdf > 0) ++counts[binOf(s.h)];
  }
  return counts;
}

/// Expected counts, from `mass(bin)`.
template <class Mass>
Histogram expectedOf(int samples, Mass&& mass) {
  Histogram expected(kResolution * kResolution);
  for (std::size_t k = 0; k < expected.size(); ++k) expected[k] = samples * mass(k);
  return expected;
}

/// For models of pyramids.
template <class Model>
Histogram expectedOfPixels(const Model& model, const Footprint& p, int samples) {
  return expectedOf(samples, [&](std::size_t k) {
    return model.pixelMean(p, test::pixelCentre(k, kResolution)) * 4.0 / (kResolution * kResolution);
  });
}

/// Every sample's pdf is the density towards it, which integrates to 1.
template <class Model>
void expectPdfIsDensity(const Model& model, const Footprint& p, int samples, float relative_error) {
  for (int k = 0; k < samples; ++k) {
    const HalfVectorSample s = model.sample(p, bake::randomPair(77, 0, k));
    ASSERT_GE(s.pdf, 0);
    if (s.pdf > 0) {
      ASSERT_NEAR(s.pdf, model.density(p, s.h), relative_error * s.pdf) << k;
    }
  }
}

template <class Model>
void expectSamplesFollowThePixels(const Model& model, const std::string& name, int samples) {
  double least = 1;
  for (int k = 0; k < kFootprints; ++k) {
    const Footprint p = randomFootprint(5, k, 5, 60);
    const ChiSquared test = chiSquared(expectedOfPixels(model, p, samples), histogramOf(model, p, samples, 100 + k), samples);
    EXPECT_GT(test.degrees, 3);
    EXPECT_GT(test.p(), kFalseAlarm / kFootprints) << name << " footprint " << k;
    least = std::min(least, test.p());
    expectPdfIsDensity(model, p, 100, 5e-6f);
  }
  testing::Test::RecordProperty(name + "_least_p", std::to_string(least));
  std::printf("%s: least p of %d footprints %.3g\n", name.c_str(), kFootprints, least);
}

TEST(Sample, OfPyramidsFollowsTheDensity) {
  for (const auto& c : cases()) {
    const NdfPyramid pyramid = c->pyramid.view();
    expectSamplesFollowThePixels(PyramidNdf(pyramid), "pyramid " + c->name, 20000);
    expectSamplesFollowThePixels(PyramidNdf(pyramid, Interpolation::footprint, Pixels::constant),
                                 "pyramid of constant pixels " + c->name, 20000);
  }
}

/// What the pixels of slices are like: choosing rows by sums that include negative pixels is right only where there are none.
struct SliceKinds {
  int without_negatives = 0, with_negatives = 0;
  double mass = 0;    ///< of all pixels, negative ones taken as 0
  double hidden = 0;  ///< how much of it the rows' sums do not show
};

/// Where a projection has a column.
int placeOf(const ColumnLayout& layout, int column) {
  const int narrow = column - layout.wide;
  if (narrow < 0) return column;
  return narrow < layout.half ? layout.low() + narrow : layout.high() + narrow - layout.half;
}

/// Compares the rows of every slice with its pixels, asked one by one as density does.
template <class Reader>
void expectRowsAreThePixels(const NdfCp& ndf, const Reader& reader, SliceKinds& kinds) {
  constexpr float kRounding = 2e-6f;  // of sums of floats, in the largest of the numbers that cancel
  for (const NdfCluster& cluster : ndf.clusters) {
    if (cluster.columns == 0) continue;
    const ColumnLayout layout(cluster);
    for (std::uint32_t slice = 0; slice < cluster.slice_count; ++slice) {
      const auto row = reader.row(cluster, slice);
      float scaled[kMaxColumns], weights[kBlockPixels];
      reader.scaledCoefficients(cluster, row, scaled);
      reader.sliceWeights(cluster, row, weights);
      float sums[kBlockSize], pixels[kBlockPixels], largest = 0;
      reader.leastSums(cluster, weights).store(sums);
      for (int y = 0; y < kBlockSize; ++y) {
        for (int x = 0; x < kBlockSize; ++x) {
          float projection[ColumnLayout::kMost];
          reader.pixel(cluster, layout, x, y, projection);
          pixels[y * kBlockSize + x] = reader.dot(projection, layout, row);
          for (int k = 0; k < cluster.columns; ++k)
            largest += std::abs(projection[placeOf(layout, k)] * scaled[k] / ndf.scales[cluster.first_scale + k]);
        }
      }
      const PixelFloors floors(ndf, cluster);
      for (int p = 0; p < kBlockPixels; ++p) pixels[p] -= floors.at(p % kBlockSize, p / kBlockSize);
      const float least = *std::min_element(pixels, pixels + kBlockPixels);
      ++(least < 0 ? kinds.with_negatives : kinds.without_negatives);
      for (int y = 0; y < kBlockSize; ++y) {
        float decoded[kBlockSize];
        reader.rowPixels(cluster, weights, y).store(decoded);
        double sum = 0, positive = 0;
        for (int x = 0; x < kBlockSize; ++x) {
          const float pixel = pixels[y * kBlockSize + x];
          ASSERT_NEAR(decoded[x], std::max(0.0f, pixel), kRounding * largest) << x << " " << y;
          sum += pixel;
          positive += std::max(0.0f, pixel);
        }
        ASSERT_NEAR(sums[y], std::max(0.0, sum), kRounding * largest) << y;
        kinds.mass += positive;
        kinds.hidden += positive - std::max(0.0, sum);
      }
    }
  }
}

TEST(Sample, OfCompressedPyramidsFollowsTheDensity) {
  for (const auto& c : cases()) {
    for (const auto& [method, type, name] : {std::tuple{CompressionMethod::cp, CoefficientType::i8, "cp i8 "},
                                             {CompressionMethod::tucker, CoefficientType::f16, "tucker f16 "},
                                             {CompressionMethod::pca, CoefficientType::i8, "pca i8 "},
                                             {CompressionMethod::pca, CoefficientType::f32, "pca f32 "}}) {
      const NdfCpData data = compress(*c, method, type);
      const NdfCp ndf = data.view();
      expectSamplesFollowThePixels(CpNdf(ndf), name + c->name, 20000);
      SliceKinds kinds;
      withReader(ndf, [&](const auto& reader) { expectRowsAreThePixels(ndf, reader, kinds); });
      std::printf("%d slices without negative pixels, %d with; %.2g %% of the mass is hidden\n", kinds.without_negatives,
                  kinds.with_negatives, 100 * kinds.hidden / kinds.mass);
      if (c->name != "flakes") continue;
      // Rows are chosen in both ways, the slow one often enough that the test notices when it is wrong.
      // Floors leave few slices without a pixel below 0.
      EXPECT_GT(kinds.without_negatives, 5);
      EXPECT_GT(kinds.with_negatives, 100);
      if (method != CompressionMethod::pca) {
        EXPECT_GT(kinds.hidden, 0.015 * kinds.mass);
      }
    }
  }
}

TEST(Sample, RowsOfCompressedSlicesAreTheirPixels) {
  // Ranks below four, a multiple of four, and beyond one: groups of four columns are read in different ways.
  for (const auto method : {CompressionMethod::cp, CompressionMethod::tucker, CompressionMethod::pca}) {
    for (const auto type : {CoefficientType::i8, CoefficientType::f16, CoefficientType::f32}) {
      for (const int rank : {1, 2, 3, 4, 7, 8}) {
        SCOPED_TRACE("method " + std::to_string(int(method)) + " type " + std::to_string(int(type)) + " rank " +
                     std::to_string(rank));
        const NdfCpData data = compress(*cases()[0], method, type, rank);
        const NdfCp ndf = data.view();
        SliceKinds kinds;
        withReader(ndf, [&](const auto& reader) { expectRowsAreThePixels(ndf, reader, kinds); });
        EXPECT_GT(kinds.mass, 0);
      }
    }
  }
}

TEST(Sample, OfSpotsAndNarrowColumnsFollowsTheDensity) {
  for (const auto& c : cases()) {
    bake::CompressionOptions o;
    o.tolerance = 0.3;
    o.metric = bake::ErrorMetric::l2;
    bake::CompressionReport report;
    const NdfCpData data = bake::compressPyramid(c->pyramid.view(), o, &report);
    if (c->name == "flakes") {
      EXPECT_GT(report.spot_slices, 0u);
    }
    const NdfCp ndf = data.view();
    expectSamplesFollowThePixels(CpNdf(ndf), "tolerance " + c->name, 20000);
    expectSamplesFollowThePixels(CpNdf(ndf, Interpolation::footprint, Pixels::constant),
                                 "tolerance, constant pixels " + c->name, 20000);
  }
}

/// For models that know the mean over any box of half vectors, and answer any footprint.
template <class Model>
void expectSamplesFollowTheMean(const Model& model, const std::string& name, const std::vector<Footprint>& footprints,
                                int samples, float pdf_error = 0) {
  double least = 1;
  for (std::size_t k = 0; k < footprints.size(); ++k) {
    const Footprint& p = footprints[k];
    const Histogram expected = expectedOf(
        samples, [&](std::size_t bin) { return double{model.mean(p, binBox(bin))} * 4 / (kResolution * kResolution); });
    const ChiSquared test = chiSquared(expected, histogramOf(model, p, samples, 200 + k), samples);
    EXPECT_GT(test.p(), kFalseAlarm / static_cast<double>(footprints.size())) << name << " footprint " << k;
    least = std::min(least, test.p());
    expectPdfIsDensity(model, p, 20, pdf_error);
  }
  testing::Test::RecordProperty(name + "_least_p", std::to_string(least));
  std::printf("%s: least p of %zu footprints %.3g\n", name.c_str(), footprints.size(), least);
}

/// Isotropic, stretched and turned Gaussians and boxes.
std::vector<Footprint> mixedFootprints(float scale) {
  std::vector<Footprint> list;
  for (int k = 0; k < kFootprints; ++k) {
    const Vec2 uv = bake::randomPair(6, 0, k), size = bake::randomPair(6, 1, k), turn = bake::randomPair(6, 2, k);
    const float a = scale * (0.3f + 2 * size.x), b = scale * (0.3f + size.y), c = std::cos(3 * turn.x),
                s = std::sin(3 * turn.x);
    const Vec2 long_axis = {a * c, a * s}, short_axis = {-b * s, b * c};
    if (k % 3 == 0) {
      list.push_back(Footprint::isotropic(uv, a));
    } else if (k % 3 == 1) {
      list.push_back(
          Footprint::gaussian(uv, {a * a * c * c + b * b * s * s, (a * a - b * b) * c * s, a * a * s * s + b * b * c * c}));
    } else {
      list.push_back(Footprint::box(uv, 2.0f * long_axis, 2.0f * short_axis));
    }
  }
  return list;
}

TEST(Sample, OfReferenceFollowsTheMean) {
  for (const auto& c : cases()) {
    const Reference model(c->map.map(), kSigmaR, Surface::flat, Boundary::wrap, Reference::Search::pruned);
    expectSamplesFollowTheMean(model, "flat " + c->name, mixedFootprints(1.5f), 4000);
  }
  const Reference clamped(cases()[0]->map.map(), kSigmaR, Surface::flat, Boundary::clamp, Reference::Search::pruned);
  expectSamplesFollowTheMean(clamped, "flat, clamped", mixedFootprints(1.5f), 4000);
}

TEST(Sample, OfReferenceOnSmoothSurfacesFollowsTheMean) {
  for (const Boundary boundary : {Boundary::wrap, Boundary::clamp}) {
    const Reference model(cases()[0]->map.map(), 0.05f, Surface::smooth, boundary, Reference::Search::pruned);
    expectSamplesFollowTheMean(model, "smooth", mixedFootprints(0.25f), 800);
  }
}

TEST(Sample, OfBinMapsFollowsTheMean) {
  constexpr float kRounding = 1e-5f;
  for (const auto& c : cases()) {
    const bake::BinMapData data = bake::buildBinMap(c->map.map(), {.alpha = 0.05f});
    expectSamplesFollowTheMean(BinMapNdf(data.view()), "bin map " + c->name, mixedFootprints(4), 10000, kRounding);
  }
}

TEST(Sample, OfHistogramsFollowsTheMean) {
  constexpr float kRounding = 1e-4f;
  for (const auto& c : cases()) {
    const bake::HistogramSatData data = bake::buildHistogramSat(c->map.map(), {.theta_bins = 9, .phi_bins = 32, .stride = 4});
    // Lobes: histogram_lobes_test.cpp.
    const HistogramNdf even(data.view(), GaussianBoxes::one, kSlantTolerance, HistogramBins::even);
    expectSamplesFollowTheMean(even, "histogram " + c->name, mixedFootprints(4), 10000, kRounding);
  }
}

TEST(Sample, OfMomentsFollowsTheMean) {
  constexpr float kRounding = 1e-5f;
  for (const auto& c : cases()) {
    const bake::SlopeMomentsData data = bake::buildSlopeMoments(c->map.map(), {});
    expectSamplesFollowTheMean(MomentsNdf(data.view(), kSigmaR), "moments " + c->name, mixedFootprints(4), 10000, kRounding);
  }
}

TEST(Sample, TheTestNoticesAWrongSampler) {
  const Case& c = *cases()[1];
  const PyramidNdf model(c.pyramid.view());
  const Footprint p = Footprint::isotropic({0.31f, 0.62f}, 9);
  constexpr int kSamples = 20000;
  const Histogram expected = expectedOfPixels(model, p, kSamples);
  // A footprint a tenth larger, and one two texels away.
  for (const Footprint& wrong :
       {Footprint::isotropic({0.31f, 0.62f}, 9.9f), Footprint::isotropic({0.31f + 2.0f / 96, 0.62f}, 9)})
    EXPECT_LT(chiSquared(expected, histogramOf(model, wrong, kSamples, 1), kSamples).p(), 1e-6);
  // One sample in twenty from somewhere else.
  Histogram counts = histogramOf(model, p, kSamples, 1);
  for (int k = 0; k < kSamples / 20; ++k) {
    const Vec2 xi = bake::randomPair(9, 9, k);
    ++counts[binOf({xi.x - 0.5f, xi.y - 0.5f})];
    --counts[binOf(model.sample(p, bake::randomPair(1, 0, k)).h)];
  }
  EXPECT_LT(chiSquared(expected, counts, kSamples).p(), 1e-6);
}

TEST(Sample, CompressedDensitiesIntegrateToOne) {
  for (const auto& c : cases()) {
    for (const auto method : {CompressionMethod::cp, CompressionMethod::tucker, CompressionMethod::pca}) {
      const NdfCpData data = compress(*c, method, CoefficientType::i8);
      const CpNdf model(data.view());
      for (int k = 0; k < 10; ++k) {
        double sum = 0;
        for (const double e : expectedOfPixels(model, randomFootprint(8, k, 2, 100), 1)) sum += e;
        EXPECT_NEAR(sum, 1, 1e-4);  // float weights and scales; without the negative parts' share it would be 1.00 to 1.06
      }
    }
  }
}

/// Pearson's statistic for each degree of freedom, over 16 x 16 bins: 1 for independent samples.
template <class Model>
double unevenness(const Model& model, const Footprint& p, bool stratified) {
  constexpr int kGrid = 64, kMerged = kResolution / 16;
  const int samples = kGrid * kGrid;
  const auto merged = [](const Histogram& fine) {
    Histogram coarse(256, 0.0);
    for (std::size_t k = 0; k < fine.size(); ++k) coarse[k / kResolution / kMerged * 16 + k % kResolution / kMerged] += fine[k];
    return coarse;
  };
  Histogram counts(kResolution * kResolution, 0.0);
  for (int k = 0; k < samples; ++k) {
    const Vec2 xi = bake::randomPair(3, 0, k);
    const Vec2 cell = {static_cast<float>(k % kGrid), static_cast<float>(k / kGrid)};
    const HalfVectorSample s = model.sample(p, stratified ? (1.0f / kGrid) * (cell + xi) : xi);
    if (s.pdf > 0) ++counts[binOf(s.h)];
  }
  const Histogram expected =
      expectedOf(samples, [&](std::size_t k) { return double{model.mean(p, binBox(k))} * 4 / (kResolution * kResolution); });
  const ChiSquared test = chiSquared(merged(expected), merged(counts), samples);
  return test.statistic / test.degrees;
}

TEST(Sample, StratifiedNumbersStayStratified) {
  // Cells of 64 x 64 numbers, drawn from in each: counts vary only by the cells that a border cuts.
  constexpr double kMostOfRandom = 0.7;
  const Case& c = *cases()[0];
  const NdfCpData data = compress(c, CompressionMethod::tucker, CoefficientType::i8);
  const auto expectStratified = [&](const auto& model, const char* name) {
    double random = 0, stratified = 0;
    for (int k = 0; k < 2; ++k) {
      const Footprint p = randomFootprint(4, k, 7, 8);
      random += unevenness(model, p, false) / 2;
      stratified += unevenness(model, p, true) / 2;
    }
    std::printf("%s: chi-squared per degree, random %.2f, stratified %.2f\n", name, random, stratified);
    EXPECT_GT(random, 0.6);
    EXPECT_LT(stratified, kMostOfRandom * random) << name;
  };
  expectStratified(PyramidNdf(c.pyramid.view()), "pyramid");
  expectStratified(CpNdf(data.view()), "tucker");
  expectStratified(Reference(c.map.map(), kSigmaR, Surface::flat, Boundary::wrap, Reference::Search::pruned), "reference");
}

template <class Model>
void expectDegenerateSamplesAreAnswered(const Model& model) {
  const Footprint p = Footprint::isotropic({0.3f, 0.7f}, 10);
  const auto expectFinite = [](const HalfVectorSample& s) {
    EXPECT_TRUE(std::isfinite(s.h.x) && std::isfinite(s.h.y) && std::isfinite(s.pdf) && s.pdf >= 0);
  };
  const auto same = [&](Vec2 a, Vec2 b) {
    EXPECT_EQ(model.sample(p, a).h, model.sample(p, b).h);
    EXPECT_EQ(model.sample(p, a).pdf, model.sample(p, b).pdf);
  };
  same({-1, kNan}, {0, 0});
  same({kInfinity, 1}, {0x1.fffffep-1f, 0x1.fffffep-1f});
  const float edge = 0x1.fffffep-1f;
  for (const Vec2 xi : {Vec2{0, 0}, Vec2{edge, edge}, Vec2{0, edge}, Vec2{0.5f, 0.5f}}) {
    expectFinite(model.sample(p, xi));
    for (const Footprint& q :
         {Footprint::isotropic({0.3f, 0.7f}, 0), Footprint::isotropic({kNan, kInfinity}, kNan),
          Footprint::isotropic({1e9f, -7}, 1e18f), Footprint::gaussian({0.1f, 0.1f}, {-4, 3, -4}),
          Footprint::gaussian({0.1f, 0.1f}, {kInfinity, 0, 1}), Footprint::box({0.1f, 0.1f}, {0, 0}, {0, 0}),
          Footprint::box({0.1f, 0.1f}, {kNan, 0}, {0, 1}), Footprint::box({0, 0}, {1e18f, 0}, {0, 1e18f}),
          Footprint::box({0.999f, 0.999f}, {40, 1}, {-1, 0.01f})}) {
      const HalfVectorSample s = model.sample(q, xi);
      expectFinite(s);
      if (s.pdf > 0) {
        EXPECT_NEAR(s.pdf, model.density(q, s.h), 5e-6f * s.pdf);
      }
    }
  }
}

TEST(Sample, DegenerateQueriesHaveFiniteAnswers) {
  const Case& c = *cases()[2];
  const OwnedMap small(12, 8, test::randomNormals(12, 8, 0.6f, 1));
  for (const Boundary boundary : {Boundary::wrap, Boundary::clamp})
    for (const Surface surface : {Surface::flat, Surface::smooth})
      expectDegenerateSamplesAreAnswered(Reference(small.map(), kSigmaR, surface, boundary, Reference::Search::pruned));
  expectDegenerateSamplesAreAnswered(PyramidNdf(c.pyramid.view()));
  expectDegenerateSamplesAreAnswered(PyramidNdf(c.pyramid.view(), c.map.map()));
  for (const auto method : {CompressionMethod::cp, CompressionMethod::tucker, CompressionMethod::pca}) {
    const NdfCpData data = compress(c, method, CoefficientType::i8);
    expectDegenerateSamplesAreAnswered(CpNdf(data.view()));
    expectDegenerateSamplesAreAnswered(CpNdf(data.view(), c.map.map()));
  }
}

TEST(Sample, BelowTheFinestLevelTheTexelsAreSampled) {
  const Case& c = *cases()[1];
  const PyramidNdf model(c.pyramid.view(), c.map.map());
  const ManifoldNdf texels(c.map.map(), kSigmaR);
  for (int k = 0; k < 100; ++k) {
    const Footprint p = randomFootprint(12, k, 0.3f, 6);
    const Vec2 xi = bake::randomPair(13, 0, k);
    EXPECT_EQ(model.sample(p, xi).h, texels.sample(p, xi).h);
    EXPECT_EQ(model.sample(p, xi).pdf, texels.sample(p, xi).pdf);
  }
}

}  // namespace
}  // namespace glint::sample_test
