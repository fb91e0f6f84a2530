#include "glint/api/batch.h"

#include <gtest/gtest.h>

#include <cmath>
#include <limits>
#include <random>
#include <string>
#include <vector>

#include "glint/bake/compressed/compress.h"
#include "support/sample_assets.h"
#include "support/small_pyramid.h"
#include "support/test_maps.h"

namespace glint::batch_test {
namespace {

constexpr float kNan = std::numeric_limits<float>::quiet_NaN();
constexpr int kSize = 64;
/// Of the pdf of a footprint whose variance is not finite: it is asked as one part, and rounded once more. All else has the same bits.
constexpr float kPdfError = 5e-6f;

struct Queries {
  std::vector<float> u, v, sigma, hx, hy;

  Queries(std::size_t count, unsigned seed) {
    std::mt19937 random(seed);
    std::uniform_real_distribution<float> unit(0, 1);
    for (std::size_t k = 0; k < count; ++k) {
      u.push_back(3 * unit(random) - 1);
      v.push_back(k % 7 == 0 ? static_cast<float>(random() % 9) / 8 : unit(random));  // centres and borders too
      sigma.push_back(std::exp2(12 * unit(random) - 3));
      hx.push_back(1.2f * unit(random) - 0.6f);
      hy.push_back(1.2f * unit(random) - 0.6f);
      if (k % 41 == 1) u.back() = kNan;
      if (k % 53 == 1) u.back() = -1e-9f;  // at the end of the map, though it is rounded to the beginning of the next
      if (k % 43 == 2) sigma.back() = kNan;
      if (k % 59 == 2) sigma.back() = 1.4e19f;  // finite variances, whose sum is not
      if (k % 47 == 3) hx.back() = k % 2 ? kNan : 1.01f;
      if (k % 53 == 4) hx.back() = hy.back() = k % 2 ? 1.0f : -1.0f;
      if (k % 59 == 5) sigma.back() = 1e20f;
    }
  }

  api::FootprintArrays footprints() const {
    api::FootprintArrays arrays;
    arrays.u = {u.data()};
    arrays.v = {v.data()};
    arrays.sigma = {sigma.data()};
    return arrays;
  }
};

template <class Model>
void expectMeansAndSamplesEqualSingleQueries(const Model& model, const Queries& q) {
  const api::AnyNdf any(model);
  const std::size_t count = q.u.size();
  std::vector<float> x1, y1, means(count + 1, -7), x(count + 1, -7), y(count + 1, -7), pdf(count + 1, -7);
  for (std::size_t k = 0; k < count; ++k) {
    x1.push_back(q.hx[k] + (k % 11 == 0 ? -0.1f : k % 5 == 0 ? 1.0f : 0.03f));  // empty, many blocks, few pixels
    y1.push_back(q.hy[k] + 0.05f);
  }
  api::means(any, count, q.footprints(), {{q.hx.data()}, {q.hy.data()}, {x1.data()}, {y1.data()}}, means.data());
  api::samples(any, count, q.footprints(), {{q.hx.data()}, {q.v.data()}}, {x.data(), y.data(), pdf.data()});
  EXPECT_EQ(means[count], -7);
  EXPECT_EQ(pdf[count], -7);
  for (std::size_t k = 0; k < count; ++k) {
    const Footprint p = Footprint::isotropic({q.u[k], q.v[k]}, q.sigma[k]);
    const float mean = model.mean(p, {{q.hx[k], q.hy[k]}, {x1[k], y1[k]}});
    ASSERT_EQ(means[k], mean) << "query " << k << " of " << count;
    const HalfVectorSample one = model.sample(p, {q.hx[k], q.v[k]});
    ASSERT_EQ(x[k], one.h.x) << "query " << k << " of " << count;
    ASSERT_EQ(y[k], one.h.y) << "query " << k << " of " << count;
    ASSERT_NEAR(pdf[k], one.pdf, kPdfError * one.pdf) << "query " << k << " of " << count;
  }
}

template <class Model>
void expectBatchesEqualSingleQueries(const Model& model, std::size_t most = 1000) {
  const api::AnyNdf any(model);
  std::size_t positive = 0;
  for (const std::size_t count : {std::size_t{1}, std::size_t{31}, std::size_t{32}, std::size_t{33}, most}) {
    const Queries q(count, static_cast<unsigned>(count));
    std::vector<float> answers(count + 1, -7);
    api::densities(any, count, q.footprints(), {{q.hx.data()}, {q.hy.data()}}, answers.data());
    EXPECT_EQ(answers[count], -7);  // nothing is written beyond the last
    for (std::size_t k = 0; k < count; ++k) {
      const float one = model.density(Footprint::isotropic({q.u[k], q.v[k]}, q.sigma[k]), {q.hx[k], q.hy[k]});
      ASSERT_EQ(answers[k], one) << "query " << k << " of " << count;
      positive += one > 0;
    }
    expectMeansAndSamplesEqualSingleQueries(model, q);
  }
  EXPECT_GT(positive, most / 10);
}

TEST(Batch, DensitiesOfPyramidsAreThoseOfSingleQueries) {
  for (const auto precision : {BlockPrecision::f16, BlockPrecision::f32}) {
    for (const Boundary boundary : {Boundary::wrap, Boundary::clamp}) {
      auto sample = test::samplePyramid(kSize, precision);
      sample.pyramid.shape.boundary = boundary;
      for (const Pixels pixels : {Pixels::smooth, Pixels::constant})
        expectBatchesEqualSingleQueries(PyramidNdf(sample.pyramid, Interpolation::footprint, pixels));
    }
  }
}

/// Values of a file are not checked: what does not count must not bring an infinity.
TEST(Batch, MeansLeaveOutLevelsThatDoNotCount) {
  auto sample = test::samplePyramid(kSize, BlockPrecision::f32);
  for (float& pixel : sample.levels[1].floats) pixel = std::numeric_limits<float>::infinity();
  for (float& mean : sample.levels[1].block_means) mean = std::numeric_limits<float>::infinity();
  const PyramidNdf model(sample.pyramid);
  const Queries q(100, 1);
  const std::vector<float> finest(100, finestSigma(model.shape()));
  api::FootprintArrays footprints = q.footprints();
  footprints.sigma = {finest.data()};
  std::vector<float> x1, y1, means(100);
  for (std::size_t k = 0; k < 100; ++k) x1.push_back(q.hx[k] + 0.5f), y1.push_back(q.hy[k] + 0.5f);
  api::means(api::AnyNdf(model), 100, footprints, {{q.hx.data()}, {q.hy.data()}, {x1.data()}, {y1.data()}}, means.data());
  for (std::size_t k = 0; k < 100; ++k) {
    ASSERT_TRUE(std::isfinite(means[k])) << k;
    const Footprint p = Footprint::isotropic({q.u[k], q.v[k]}, finest[k]);
    ASSERT_EQ(means[k], model.mean(p, {{q.hx[k], q.hy[k]}, {x1[k], y1[k]}})) << k;
  }
}

TEST(Batch, DensitiesOfCompressedPyramidsAreThoseOfSingleQueries) {
  for (const auto method : {CompressionMethod::cp, CompressionMethod::tucker, CompressionMethod::pca}) {
    for (const auto type : {CoefficientType::i8, CoefficientType::f16, CoefficientType::f32}) {
      SCOPED_TRACE("method " + std::to_string(int(method)) + " type " + std::to_string(int(type)));
      const auto sample = test::sampleNdfCp(kSize, method, type);
      expectBatchesEqualSingleQueries(CpNdf(sample.ndf));
    }
  }
  for (const auto form : {test::SampleForm::narrow, test::SampleForm::spots}) {
    SCOPED_TRACE("form " + std::to_string(int(form)));
    const auto sample = test::sampleNdfCp(kSize, CompressionMethod::tucker, CoefficientType::i8, form);
    expectBatchesEqualSingleQueries(CpNdf(sample.ndf));
  }
}

TEST(Batch, WhatEmptyClustersSayIsNotFollowed) {
  // Regions of the flat half have no slices in most blocks.
  std::vector<Vec2> normals = test::synthesised(bake::SynthKind::flakes, 96, 64, 0.25f);
  for (std::size_t k = 0; k < normals.size(); ++k)
    if (k % 96 < 48) normals[k] = {};
  const test::OwnedMap map(96, 64, normals);
  const bake::NdfPyramidData pyramid = test::smallPyramid(map.map());
  for (const auto method : {CompressionMethod::cp, CompressionMethod::tucker, CompressionMethod::pca}) {
    bake::CompressionOptions c;
    c.method = method;
    c.regions = 8;
    bake::NdfCpData data = bake::compressPyramid(pyramid.view(), c);
    int empty = 0;
    for (NdfCluster& cluster : data.clusters) {
      if (cluster.slice_count > 0) continue;
      ++empty;
      cluster.first_coefficient = std::uint64_t{1} << 50;
      cluster.first_basis = cluster.first_scale = 0xfffffff0u;
      cluster.columns = 200;
      cluster.rank_x = cluster.rank_y = 16;
    }
    EXPECT_GT(empty, 0);
    expectBatchesEqualSingleQueries(CpNdf(data.view()));
  }
}

TEST(Batch, FootprintsBelowTheFinestLevelAreAnsweredFromTheTexels) {
  const auto map = test::sampleNormals(kSize, kSize);
  const auto pyramid = test::samplePyramid(kSize, BlockPrecision::f16);
  for (const Pixels pixels : {Pixels::smooth, Pixels::constant})
    expectBatchesEqualSingleQueries(PyramidNdf(pyramid.pyramid, map.map, Interpolation::footprint, pixels), 60);
  const auto compressed = test::sampleNdfCp(kSize, CompressionMethod::cp, CoefficientType::i8);
  expectBatchesEqualSingleQueries(CpNdf(compressed.ndf, map.map), 60);
}

}  // namespace
}  // namespace glint::batch_test
