#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <map>
#include <random>
#include <vector>

#include "glint/api/any_brdf.h"
#include "glint/api/wave_colours.h"
#include "glint/query/anisotropic_ndf.h"
#include "glint/query/brdf/wave_brdf.h"
#include "glint/query/wave_ndf.h"
#include "support/c_api.h"
#include "support/sample_assets.h"
#include "support/temp_folder.h"

namespace glint::wave_query_test {
namespace {

constexpr int kSize = 64;
/// Halves err by 2^-11 of themselves, on both sides.
constexpr float kOfHalves = 2e-3f;

const test::SampleWavePyramid& sample(WaveChannels meaning, BlockPrecision precision) {
  static std::map<std::pair<WaveChannels, BlockPrecision>, test::SampleWavePyramid> samples;
  const auto [found, added] = samples.try_emplace({meaning, precision});
  if (added) {
    found->second = test::sampleWavePyramid(kSize, meaning, precision);
    // Spans point into the sample that was moved from: vectors keep their memory when they are moved.
  }
  return found->second;
}

struct Question {
  Footprint footprint;
  Vec2 psi;
};

std::vector<Question> someQuestions() {
  std::mt19937 random(5);
  std::uniform_real_distribution<float> unit(0, 1);
  std::vector<Question> questions;
  for (int k = 0; k < 300; ++k) {
    const Vec2 centre = {unit(random), unit(random)};
    const float sigma = 4 + 40 * unit(random);
    const Vec2 psi = {1.2f * unit(random) - 0.6f, 1.2f * unit(random) - 0.6f};
    if (k % 3 == 0)
      questions.push_back({Footprint::gaussian(centre, {sigma * sigma, 0.3f * sigma * sigma, 0.5f * sigma * sigma}), psi});
    else
      questions.push_back({Footprint::isotropic(centre, sigma), psi});
  }
  return questions;
}

TEST(WaveNdf, ChannelsAreTheGreyDensityTimesTheirShares) {
  for (const BlockPrecision precision : {BlockPrecision::f16, BlockPrecision::f32})
    for (const WaveChannels meaning : {WaveChannels::xyz, WaveChannels::spectral})
      for (const Pixels pixels : {Pixels::smooth, Pixels::constant}) {
        const WavePyramid& wave = sample(meaning, precision).wave;
        const std::vector<float> shares =
            meaning == WaveChannels::xyz ? std::vector{1.25f, 1.0f, 0.75f} : std::vector{0.5f, 0.75f, 1.0f, 1.25f, 1.5f};
        const AnisotropicNdf<WaveNdf> model(WaveNdf(wave, Interpolation::footprint, pixels));
        const AnisotropicNdf<PyramidNdf> grey(PyramidNdf(wave.grey, Interpolation::footprint, pixels));
        for (const Question& q : someQuestions()) {
          const float density = grey.density(q.footprint, q.psi);
          EXPECT_EQ(model.density(q.footprint, q.psi), density);
          std::vector<float> spectrum(shares.size());
          model.densitySpectrum(q.footprint, q.psi, spectrum.data());
          Rgb expected;
          for (std::size_t c = 0; c < shares.size(); ++c) {
            EXPECT_NEAR(spectrum[c], shares[c] * density, kOfHalves * density + 1e-6f);
            expected = expected + spectrum[c] * wave.channel_rgb[c];
          }
          const Rgb rgb = model.densityRgb(q.footprint, q.psi);
          const float rounding = 1e-5f * (density + 1);
          EXPECT_NEAR(rgb.r, expected.r, rounding);
          EXPECT_NEAR(rgb.g, expected.g, rounding);
          EXPECT_NEAR(rgb.b, expected.b, rounding);
        }
      }
}

TEST(WaveNdf, IsZeroOutsideTheSquare) {
  const WaveNdf model(sample(WaveChannels::xyz, BlockPrecision::f16).wave);
  for (const Vec2 psi : {Vec2{1.01f, 0}, Vec2{0, -2}, Vec2{NAN, 0}}) {
    EXPECT_EQ(model.density({}, psi), 0);
    EXPECT_EQ(model.densityRgb({}, psi), Rgb{});
  }
}

WaveBrdf<WaveNdf> mirrorBrdf(const WaveNdf& model, const Footprint& footprint) {
  return {model, footprint, SmithMasking(model.shape().slopes, model.shape().sigma_r), Fresnel::mirror()};
}

Vec3 directionOf(float x, float y) { return {x, y, std::sqrt(1 - x * x - y * y)}; }

TEST(WaveBrdf, IsReciprocalAndFollowsItsFormula) {
  const WaveNdf model(sample(WaveChannels::spectral, BlockPrecision::f32).wave);
  const Footprint footprint = Footprint::isotropic({0.3f, 0.6f}, 12);
  const WaveBrdf brdf = mirrorBrdf(model, footprint);
  const SmithMasking masking(model.shape().slopes, model.shape().sigma_r);
  std::mt19937 random(2);
  std::uniform_real_distribution<float> component(-0.6f, 0.6f);
  int lit = 0;
  for (int k = 0; k < 200; ++k) {
    const Vec3 wi = directionOf(component(random), component(random)), wo = directionOf(component(random), component(random));
    const Rgb f = brdf.evaluate(wi, wo), back = brdf.evaluate(wo, wi);
    EXPECT_NEAR(f.g, back.g, 1e-5f * f.g);
    const Vec2 psi = {0.5f * (wi.x + wo.x), 0.5f * (wi.y + wo.y)};
    const float expected = 0.25f * std::max(model.densityRgb(footprint, psi).g, 0.0f) * masking.g2(wi, wo);
    EXPECT_NEAR(f.g, expected, 1e-5f * expected);
    EXPECT_NEAR(brdf.pdf(wi, wo), 0.25f * wi.z * model.density(footprint, psi), 1e-5f * brdf.pdf(wi, wo));
    lit += f.g > 0 ? 1 : 0;
  }
  EXPECT_GT(lit, 20);
  EXPECT_EQ(brdf.evaluate({0, 0, -1}, {0, 0, 1}), Rgb{});
  EXPECT_EQ(brdf.pdf({NAN, 0, 1}, {0, 0, 1}), 0);
}

TEST(WaveBrdf, DirectionsFollowThePdf) {
  constexpr int kCells = 16, kSamples = 200000, kPoints = 24;
  const WaveNdf model(sample(WaveChannels::xyz, BlockPrecision::f32).wave);
  for (const Vec3 wo : {Vec3{0, 0, 1}, directionOf(0.6f, -0.3f)}) {
    const WaveBrdf brdf = mirrorBrdf(model, Footprint::isotropic({0.7f, 0.2f}, 10));
    // wi in cells of its projection on the plane, where d(omega) = d(wi_xy) / wi.z.
    std::vector<double> expected(kCells * kCells), counts(kCells * kCells);
    const auto cellOf = [](float x) { return std::clamp(static_cast<int>((x + 1) * 0.5f * kCells), 0, kCells - 1); };
    for (int j = 0; j < kCells * kPoints; ++j)
      for (int i = 0; i < kCells * kPoints; ++i) {
        const float step = 2.0f / (kCells * kPoints), x = (static_cast<float>(i) + 0.5f) * step - 1;
        const float y = (static_cast<float>(j) + 0.5f) * step - 1;
        if (x * x + y * y >= 0.9999f) continue;
        const Vec3 wi = directionOf(x, y);
        expected[j / kPoints * kCells + i / kPoints] += double{brdf.pdf(wi, wo)} / wi.z * step * step * kSamples;
      }
    std::mt19937 random(9);
    std::uniform_real_distribution<float> unit(0, 1);
    for (int k = 0; k < kSamples; ++k) {
      const BrdfSample drawn = brdf.sample(wo, {unit(random), unit(random)});
      if (!(drawn.pdf > 0)) continue;
      EXPECT_NEAR(drawn.pdf, brdf.pdf(drawn.wi, wo), 2e-3f * drawn.pdf + 1e-5f);
      counts[cellOf(drawn.wi.y) * kCells + cellOf(drawn.wi.x)] += 1;
    }
    double chi_squared = 0;
    int cells = 0;
    for (std::size_t k = 0; k < counts.size(); ++k) {
      if (expected[k] < 20) continue;  // too few for a normal deviation
      chi_squared += (counts[k] - expected[k]) * (counts[k] - expected[k]) / expected[k];
      ++cells;
    }
    ASSERT_GT(cells, 10);
    // Five deviations of chi-squared, and the error of the midpoint rule.
    EXPECT_LT(chi_squared, cells + 5 * std::sqrt(2.0 * cells) + 0.2 * cells);
  }
}

TEST(WaveBrdf, SamplesAverageToTheReflectedLight) {
  constexpr int kSamples = 100000, kPoints = 700;
  const WaveNdf model(sample(WaveChannels::spectral, BlockPrecision::f32).wave);
  const WaveBrdf brdf = mirrorBrdf(model, Footprint::isotropic({0.1f, 0.9f}, 15));
  const Vec3 wo = directionOf(0.2f, 0.3f);
  Rgb sampled, integral;
  std::mt19937 random(4);
  std::uniform_real_distribution<float> unit(0, 1);
  for (int k = 0; k < kSamples; ++k)
    sampled = sampled + (1.0f / kSamples) * brdf.sample(wo, {unit(random), unit(random)}).weight;
  for (int j = 0; j < kPoints; ++j)
    for (int i = 0; i < kPoints; ++i) {
      const float step = 2.0f / kPoints, x = (static_cast<float>(i) + 0.5f) * step - 1,
                  y = (static_cast<float>(j) + 0.5f) * step - 1;
      if (x * x + y * y < 0.9999f) integral = integral + step * step * brdf.evaluate(directionOf(x, y), wo);
    }
  constexpr float kTolerance = 0.01f;  // weights differ by a share of the channels; the rest is the midpoint rule
  EXPECT_NEAR(sampled.r, integral.r, kTolerance * integral.r);
  EXPECT_NEAR(sampled.g, integral.g, kTolerance * integral.g);
  EXPECT_NEAR(sampled.b, integral.b, kTolerance * integral.b);
  EXPECT_GT(integral.g, 0.5f);
}

TEST(WaveNdf, IsFiniteForAllNumbersThatAFileMayHave) {
  test::SampleWavePyramid spoiled = test::sampleWavePyramid(kSize, WaveChannels::xyz, BlockPrecision::f32);
  std::mt19937 random(7);
  const float numbers[] = {NAN, INFINITY, -INFINITY, 3e38f, -3e38f};
  for (auto& level : spoiled.floats)
    for (float& value : level)
      if (random() % 4 == 0) value = numbers[random() % std::size(numbers)];
  const api::AnyNdf model = AnisotropicNdf<WaveNdf>(WaveNdf(spoiled.wave));
  const WaveBrdf brdf = mirrorBrdf(std::get<AnisotropicNdf<WaveNdf>>(model).round(), Footprint::isotropic({0.5f, 0.5f}, 9));
  for (const Question& q : someQuestions()) {
    const Rgb rgb = api::densityRgb(model, q.footprint, q.psi);
    EXPECT_TRUE(std::isfinite(rgb.r) && std::isfinite(rgb.g) && std::isfinite(rgb.b));
    float spectrum[3];
    api::densitySpectrum(model, q.footprint, q.psi, spectrum);
    for (const float density : spectrum) EXPECT_TRUE(std::isfinite(density) && density >= 0);
    const Rgb f = brdf.evaluate(directionOf(q.psi.x, q.psi.y), {0, 0, 1});
    EXPECT_TRUE(std::isfinite(f.r) && std::isfinite(f.g) && std::isfinite(f.b));
  }
}

class WaveAsset : public ::testing::Test {
 protected:
  WaveAsset() : path_(folder_.path() / "wave.glint") {
    formats::writeAsset(path_, sample(WaveChannels::spectral, BlockPrecision::f16).wave, test::sampleProvenance());
  }
  test::TempFolder folder_;
  std::filesystem::path path_;
};

TEST_F(WaveAsset, IsAnsweredByWaveBrdfWhateverFacetsAreAskedFor) {
  const api::OpenedNdf opened = api::OpenedNdf::open(path_);
  const auto& model = std::get<AnisotropicNdf<WaveNdf>>(opened.model());
  const api::AnyBrdf any(opened, Fresnel::mirror());
  EXPECT_EQ(any.facets(), api::BrdfFacets::waves);
  const Footprint footprint = Footprint::isotropic({0.4f, 0.4f}, 10);
  const WaveBrdf brdf(model, footprint, opened.masking(), Fresnel::mirror());
  const Vec3 wi = directionOf(0.1f, 0.05f), wo = directionOf(-0.02f, 0.1f);
  EXPECT_EQ(any.evaluate(footprint, wi, wo), brdf.evaluate(wi, wo));
  EXPECT_EQ(any.pdf(footprint, wi, wo), brdf.pdf(wi, wo));
  EXPECT_EQ(any.sample(footprint, wo, {0.3f, 0.8f}).wi.x, brdf.sample(wo, {0.3f, 0.8f}).wi.x);
}

TEST_F(WaveAsset, AnswersColoursThroughTheCInterface) {
  glint_ndf* ndf = nullptr;
  ASSERT_EQ(glint_ndf_open(path_.string().c_str(), nullptr, &ndf), GLINT_OK);
  const api::OpenedNdf opened = api::OpenedNdf::open(path_);
  int32_t channels = 0;
  EXPECT_EQ(glint_ndf_channels(ndf, &channels), GLINT_OK);
  ASSERT_EQ(channels, 5);
  const glint_footprint at = glint_footprint_isotropic(0.25, 0.75, 9);
  const Footprint same = Footprint::isotropic({0.25f, 0.75f}, 9);
  float rgb[3], spectrum[5], expected[5];
  EXPECT_EQ(glint_density_rgb(ndf, &at, 0.1f, -0.1f, rgb), GLINT_OK);
  EXPECT_EQ((Rgb{rgb[0], rgb[1], rgb[2]}), api::densityRgb(opened.model(), same, {0.1f, -0.1f}));
  EXPECT_EQ(glint_density_spectrum(ndf, &at, 0.1f, -0.1f, spectrum, 5), GLINT_OK);
  api::densitySpectrum(opened.model(), same, {0.1f, -0.1f}, expected);
  EXPECT_TRUE(std::equal(spectrum, spectrum + 5, expected));
  EXPECT_EQ(glint_density_spectrum(ndf, &at, 0.1f, -0.1f, spectrum, 4), GLINT_ERROR_USAGE);
  EXPECT_EQ(glint_density_rgb(ndf, &at, 0, 0, nullptr), GLINT_ERROR_USAGE);
  EXPECT_EQ(glint_ndf_channels(ndf, nullptr), GLINT_ERROR_USAGE);
  // Batches of one footprint.
  const float u = 0.25f, v = 0.75f, sigma = 9, x[2] = {0.1f, -0.2f}, y[2] = {-0.1f, 0.1f};
  glint_footprints footprints = {};
  footprints.u = {&u, 0}, footprints.v = {&v, 0}, footprints.sigma = {&sigma, 0};
  float many[6];
  EXPECT_EQ(glint_density_rgb_batch(ndf, 2, &footprints, {x, sizeof(float)}, {y, sizeof(float)}, many), GLINT_OK);
  EXPECT_TRUE(std::equal(many, many + 3, rgb));
  EXPECT_EQ(glint_density_rgb_batch(ndf, 2, &footprints, {nullptr, 0}, {y, sizeof(float)}, many), GLINT_ERROR_USAGE);
  EXPECT_EQ(glint_density_rgb_batch(ndf, 0, nullptr, {nullptr, 0}, {nullptr, 0}, nullptr), GLINT_OK);
  glint_ndf_close(ndf);
}

TEST(WaveCpAsset, IsAnsweredAsAWavePyramid) {
  const test::TempFolder folder;
  const auto path = folder.path() / "w.glint";
  const test::SampleWaveCp compressed = test::sampleWaveCp(kSize, WaveChannels::spectral);
  formats::writeAsset(path, compressed.wave, test::sampleProvenance());
  const api::OpenedNdf opened = api::OpenedNdf::open(path);
  ASSERT_TRUE(api::isWave(opened.model()));
  ASSERT_EQ(api::channelCount(opened.model()), 5);
  const AnisotropicNdf<WaveCpNdf> model(WaveCpNdf(compressed.wave));
  const api::AnyBrdf any(opened, Fresnel::mirror());
  EXPECT_EQ(any.facets(), api::BrdfFacets::waves);
  const Vec3 wi = directionOf(0.1f, 0.05f), wo = directionOf(-0.02f, 0.1f);
  for (const Question& q : someQuestions()) {
    EXPECT_EQ(opened.model().density(q.footprint, q.psi), model.density(q.footprint, q.psi));
    EXPECT_EQ(api::densityRgb(opened.model(), q.footprint, q.psi), model.densityRgb(q.footprint, q.psi));
    const WaveBrdf brdf(model, q.footprint, opened.masking(), Fresnel::mirror());
    EXPECT_EQ(any.evaluate(q.footprint, wi, wo), brdf.evaluate(wi, wo));
    EXPECT_EQ(any.sample(q.footprint, wo, {0.3f, 0.8f}).wi.x, brdf.sample(wo, {0.3f, 0.8f}).wi.x);
  }
  glint_ndf* ndf = nullptr;
  ASSERT_EQ(glint_ndf_open(path.string().c_str(), nullptr, &ndf), GLINT_OK);
  const glint_footprint at = glint_footprint_isotropic(0.25, 0.75, 9);
  float rgb[3], spectrum[5], expected[5];
  EXPECT_EQ(glint_density_rgb(ndf, &at, 0.1f, -0.1f, rgb), GLINT_OK);
  EXPECT_EQ((Rgb{rgb[0], rgb[1], rgb[2]}), model.densityRgb(Footprint::isotropic({0.25f, 0.75f}, 9), {0.1f, -0.1f}));
  EXPECT_EQ(glint_density_spectrum(ndf, &at, 0.1f, -0.1f, spectrum, 5), GLINT_OK);
  model.densitySpectrum(Footprint::isotropic({0.25f, 0.75f}, 9), {0.1f, -0.1f}, expected);
  EXPECT_TRUE(std::equal(spectrum, spectrum + 5, expected));
  glint_ndf_close(ndf);
}

}  // namespace
}  // namespace glint::wave_query_test
