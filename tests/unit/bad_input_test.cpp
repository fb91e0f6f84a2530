// Queries that no renderer means to ask, put to every model alike: answers are finite, and 0 where nothing can be said.

#include <gtest/gtest.h>

#include <cmath>
#include <limits>
#include <random>
#include <string>
#include <variant>
#include <vector>

#include "glint/api/any_ndf.h"
#include "glint/query/anisotropic_ndf.h"
#include "glint/query/bin_map_ndf.h"
#include "glint/query/brdf/displaced_brdf.h"
#include "glint/query/brdf/microfacet_brdf.h"
#include "glint/query/cp_ndf.h"
#include "glint/query/light/environment.h"
#include "glint/query/manifold_ndf.h"
#include "glint/query/pyramid_ndf.h"
#include "glint/query/reference.h"
#include "support/c_api.h"
#include "support/sample_assets.h"

namespace glint::bad_input_test {
namespace {

constexpr float kNan = std::numeric_limits<float>::quiet_NaN();
constexpr float kInfinity = std::numeric_limits<float>::infinity();
constexpr float kLargest = std::numeric_limits<float>::max();
constexpr int kSize = 32;

/// Calls visitor(model, name) for every model of the NDF: variants of some models, with and without the texels, and the model of
/// every kind of asset.
template <class Visitor>
void forEachModel(Visitor&& visitor) {
  const auto map = test::sampleNormals(kSize, kSize);
  // A mean over a smooth surface of random normals costs a piece for every deviation of every triangle: few, and wide ones.
  const auto small = test::sampleNormals(8, 8);
  for (const Surface surface : {Surface::flat, Surface::smooth})
    for (const Boundary boundary : {Boundary::wrap, Boundary::clamp}) {
      visitor(Reference(small.map, 0.25f, surface, boundary, Reference::Search::pruned), "Reference");
      visitor(ManifoldNdf(map.map, 0.02f, surface, boundary), "ManifoldNdf");
    }
  for (const auto precision : {BlockPrecision::f16, BlockPrecision::f32}) {
    const auto pyramid = test::samplePyramid(kSize, precision);
    const PyramidNdf round(pyramid.pyramid);
    visitor(round, "PyramidNdf");
    visitor(PyramidNdf(pyramid.pyramid, map.map), "PyramidNdf with texels");
    visitor(AnisotropicNdf<PyramidNdf>(round), "AnisotropicNdf");
  }
  for (const auto method : {CompressionMethod::cp, CompressionMethod::tucker, CompressionMethod::pca}) {
    const auto compressed = test::sampleNdfCp(kSize, method, CoefficientType::i8);
    visitor(CpNdf(compressed.ndf), "CpNdf");
    visitor(CpNdf(compressed.ndf, map.map), "CpNdf with texels");
  }
  for (const char* kind : test::kKinds) {
    const auto opened = api::OpenedNdf::open(test::assets().path(kind));
    std::visit([&](const auto& model) { visitor(model, kind); }, opened.model());
  }
}

/// Calls visitor(footprint, what).
template <class Visitor>
void forEachBadFootprint(Visitor&& visitor) {
  const auto visit = [&](const Footprint& p, const char* what, float a, float b) {
    visitor(p, std::string(what) + ' ' + std::to_string(a) + ' ' + std::to_string(b));
  };
  for (const float u : {0.3f, -7.25f, -1e9f, kNan})
    for (const float size : {0.0f, 5.0f, 1e18f, kInfinity, kNan}) {
      visit(Footprint::isotropic({u, 0.7f}, size), "isotropic", u, size);
      visit(Footprint::gaussian({0.2f, u}, {size, size, 9}), "gaussian", u, size);
      visit(Footprint::box({u, u}, {size, 1}, {-1, size}), "box", u, size);
      visit(Footprint::box({0.5f, u}, {size, size}, {size, size}), "line", u, size);
    }
  for (const float variance : {2e6f, 3e38f})
    visit(Footprint::gaussian({0.2f, 0.3f}, {variance, variance, variance}), "thin", 0, variance);
}

template <class Model>
void expectDefinedAnswers(const Model& model, const Footprint& p) {
  const auto defined = [](float value) { return std::isfinite(value) && value >= 0; };
  for (const Vec2 h : {Vec2{0.02f, -0.03f}, {0.8f, 0.8f}, {1, -1}}) EXPECT_TRUE(defined(model.density(p, h))) << h.x;
  for (const Vec2 h : {Vec2{1.001f, 0}, {0, -1.5f}, {kNan, 0}, {0, kNan}, {kInfinity, -kInfinity}, {kLargest, 0}})
    EXPECT_EQ(model.density(p, h), 0) << h.x;
  for (const Box2& range :
       {Box2{{-0.1f, -0.1f}, {0.2f, 0.1f}}, {{-1, -1}, {1, 1}}, {{-50, 0.1f}, {50, 0.2f}}, {{0.9f, 0.9f}, {1e9f, 1e9f}}})
    EXPECT_TRUE(defined(model.mean(p, range))) << range.low.x;
  for (const Box2& range : {Box2{{0.1f, 0.1f}, {0.1f, 0.2f}}, {{0.2f, 0}, {-0.2f, 1}}, {{kNan, 0}, {1, 1}}, {{2, 2}, {3, 3}}})
    EXPECT_EQ(model.mean(p, range), 0) << range.low.x;
  for (const Vec2 xi : {Vec2{0.4f, 0.6f}, {0, 0}, {1, 1}, {-2, 7}, {kNan, kNan}, {kInfinity, -kInfinity}}) {
    const HalfVectorSample s = model.sample(p, xi);
    EXPECT_TRUE(defined(s.pdf) && std::isfinite(s.h.x) && std::isfinite(s.h.y)) << xi.x;
    EXPECT_TRUE(s.pdf > 0 || s.h == Vec2{}) << xi.x;
  }
}

TEST(BadInput, EveryModelAnswersEveryFootprint) {
  forEachModel([](const auto& model, const char* name) {
    SCOPED_TRACE(name);
    forEachBadFootprint([&](const Footprint& p, const std::string& what) {
      SCOPED_TRACE(what);
      expectDefinedAnswers(model, p);
    });
  });
}

/// Every third number becomes a bad one.
template <class Number>
void spoil(std::vector<Number>& numbers, Number bad) {
  for (std::size_t k = 0; k < numbers.size(); k += 3) numbers[k] = bad;
}

/// Calls visitor(model, name) for every model, of a file whose numbers were spoiled: these are not checked when it is opened.
template <class Visitor>
void forEachSpoiledModel(float bad, std::uint16_t bad_half, Visitor&& visitor) {
  auto map = test::sampleNormals(8, 8, false);
  spoil(map.normals, Vec2{bad, bad});
  for (const Surface surface : {Surface::flat, Surface::smooth}) {
    visitor(Reference(map.map, 0.25f, surface), "Reference");
    visitor(ManifoldNdf(map.map, 0.25f, surface), "ManifoldNdf");
  }
  for (const auto precision : {BlockPrecision::f16, BlockPrecision::f32}) {
    auto pyramid = test::samplePyramid(kSize, precision);
    for (auto& level : pyramid.levels) {
      spoil(level.floats, bad);
      spoil(level.halves, bad_half);
      spoil(level.block_means, bad);
    }
    visitor(PyramidNdf(pyramid.pyramid), "PyramidNdf");
  }
  for (const auto method : {CompressionMethod::cp, CompressionMethod::tucker, CompressionMethod::pca}) {
    for (const auto type : {CoefficientType::i8, CoefficientType::f16, CoefficientType::f32}) {
      auto compressed = test::sampleNdfCp(kSize, method, type);
      spoil(compressed.coefficients_f32, bad);
      spoil(compressed.coefficients_f16, bad_half);
      visitor(CpNdf(compressed.ndf), "CpNdf");
      spoil(compressed.scales, bad);
      spoil(compressed.density_scales, bad);
      spoil(compressed.image_scales, bad);
      visitor(CpNdf(compressed.ndf), "CpNdf with bad scales");
    }
  }
  auto bins = test::sampleBinMap(kSize, kSize);
  spoil(bins.block_moments, bad_half);
  visitor(BinMapNdf(bins.map), "BinMapNdf");
}

TEST(BadInput, ModelsAnswerFromAnyNumbersOfAFile) {
  for (const auto& [bad, bad_half] : {std::pair<float, std::uint16_t>{kNan, 0x7e00},
                                      {-kNan, 0xfe00},
                                      {kInfinity, 0x7c00},
                                      {-kInfinity, 0xfc00},
                                      {kLargest, 0x7bff},
                                      {-1, 0xbc00}}) {
    forEachSpoiledModel(bad, bad_half, [&, bad = bad](const auto& model, const char* name) {
      SCOPED_TRACE(name + std::string(" of ") + std::to_string(bad));
      for (const Footprint& p : {Footprint::isotropic({0.3f, 0.7f}, 5), Footprint::isotropic({0.1f, 0.9f}, 0.3f),
                                 Footprint::box({0.5f, 0.5f}, {9, 1}, {-1, 7})})
        expectDefinedAnswers(model, p);
    });
  }
}

TEST(BadInput, DisplacedBrdfsAnswerFromAnyNumbersOfAFile) {
  for (const float bad : {kNan, kInfinity, -kInfinity, kLargest, -1.0f}) {
    auto sample = test::sampleDisplacement(64);
    for (auto& level : sample.levels) {
      spoil(level.spatial_scale, bad);
      spoil(level.lobes, VmfLobe{{bad, bad}, bad, bad});
    }
    const DisplacedBrdf brdf(sample.displacement);
    std::mt19937 random(1);
    const auto unit = [&] { return static_cast<float>(random() >> 8) * 0x1p-24f; };
    for (int k = 0; k < 500; ++k) {
      const Vec2 uv = {unit(), unit()};
      const Vec3 wo = {0.6f, 0, 0.8f}, wi = {-0.48f, 0.36f, 0.8f};
      const Rgb f = brdf.evaluate(0, uv, wi, wo);
      ASSERT_TRUE(std::isfinite(f.r) && f.r >= 0) << bad;
      const float pdf = brdf.pdf(0, uv, wi, wo);
      ASSERT_TRUE(std::isfinite(pdf) && pdf >= 0) << bad;
      const DirectionSample s = brdf.sample(0, uv, wo, {unit(), unit()});
      ASSERT_TRUE(std::isfinite(s.pdf) && s.pdf >= 0) << bad;
    }
  }
}

TEST(BadInput, EveryModelLightsASurfaceFromAnyDirection) {
  const SmithMasking masking({{0, 0}, {0.02f, 0, 0.02f}}, 0.05f);
  const SphericalGaussian lights[] = {
      {{0.6f, 0, 0.8f}, 40, {1, 1, 1}}, {{0, 0, -1}, 1e9f, {1, 1, 1}}, {{kNan, 0, 1}, 1, {1, 1, 1}}};
  forEachModel([&](const auto& model, const char* name) {
    SCOPED_TRACE(name);
    for (const Footprint& p : {Footprint::isotropic({0.3f, 0.7f}, 9), Footprint::isotropic({-1e9f, kNan}, kInfinity),
                               Footprint::gaussian({0, 0}, {0, kNan, 1}), Footprint::box({kInfinity, 0}, {0, 0}, {kNan, 1})}) {
      const MicrofacetBrdf brdf(model, p, masking, Fresnel::mirror());
      const Vec3 good = {0.6f, 0, 0.8f};
      for (const Vec3 bad :
           {Vec3{0, 0, -1}, {1, 0, 0}, {0.6f, 0, -0.8f}, {0, 0, 0}, {kNan, 0, 1}, {0, kInfinity, 1}, {3, 4, 5}}) {
        EXPECT_EQ(brdf.evaluate(bad, good), Rgb{});
        EXPECT_EQ(brdf.evaluate(good, bad), Rgb{});
        EXPECT_EQ(brdf.pdf(bad, good), 0);
        EXPECT_EQ(brdf.pdf(good, bad), 0);
        EXPECT_EQ(brdf.sample(bad, {0.5f, 0.5f}).pdf, 0);
        EXPECT_EQ(prefilteredRadiance(brdf, bad, lights[0]), Rgb{});
      }
      for (const Vec3 wo : {Vec3{0, 0, 1}, good, {1, 0, 1e-4f}}) {
        const BrdfSample s = brdf.sample(wo, {kNan, 0.5f});
        EXPECT_TRUE(std::isfinite(s.pdf) && s.pdf >= 0 && std::isfinite(s.weight.r) && s.weight.r >= 0);
        EXPECT_TRUE(std::isfinite(brdf.evaluate(good, wo).r) && brdf.evaluate(good, wo).r >= 0);
        const float radiance = prefilteredRadiance(brdf, wo, SphericalGaussians{lights, 3}).r;
        EXPECT_TRUE(std::isfinite(radiance) && radiance >= 0);
      }
    }
  });
}

}  // namespace
}  // namespace glint::bad_input_test
