// Footprints with a spread in the C interface: pixels of a curved surface, against the C++ class and against brute force.

#include <gtest/gtest.h>

#include <cmath>
#include <vector>

#include "glint.h"
#include "glint/api/any_brdf.h"
#include "glint/api/any_ndf.h"
#include "glint/api/plane_position.h"
#include "glint/query/curved_ndf.h"
#include "support/c_api.h"
#include "support/directions.h"

namespace glint::c_curved_test {
namespace {

using namespace test;

constexpr float kBatchError = 1e-6f;  // batches may sum in another order
constexpr Vec2 kSpread = {0.06f, 0.03f};

glint_footprint curvedAt(float u, float v, float sigma, Vec2 spread) {
  glint_footprint p = glint_footprint_isotropic(u, v, sigma);
  p.spread[0] = spread.x, p.spread[1] = spread.y;
  return p;
}

TEST(CCurved, AnswersAsTheClassDoes) {
  for (const char* kind : kKinds) {
    SCOPED_TRACE(kind);
    const auto opened = api::OpenedNdf::open(assets().path(kind));
    const Handle ndf = openHandle(kind);
    const Queries q(24);
    int lit = 0;
    for (std::size_t k = 0; k < q.u.size(); ++k) {
      const glint_footprint p = curvedAt(q.u[k], q.v[k], q.sigma[k], kSpread);
      const Footprint same = Footprint::isotropic(wrappedUv(double{q.u[k]}, double{q.v[k]}), q.sigma[k]);
      const api::AnyNdf moved = api::movedTo(opened.model(), double{q.u[k]}, double{q.v[k]});
      const CurvedNdf<api::AnyNdf> curved(moved, kSpread);
      float density = -1, mean = -1, hx = -1, hy = -1, pdf = -1;
      ASSERT_EQ(glint_density(ndf.get(), &p, q.hx[k], q.hy[k], &density), GLINT_OK);
      EXPECT_EQ(density, curved.density(same, {q.hx[k], q.hy[k]}));
      ASSERT_EQ(glint_mean(ndf.get(), &p, -0.1f, 0, 0.2f, 0.1f, &mean), GLINT_OK);
      EXPECT_EQ(mean, curved.mean(same, {{-0.1f, 0}, {0.2f, 0.1f}}));
      ASSERT_EQ(glint_sample(ndf.get(), &p, 0.3f, 0.7f, &hx, &hy, &pdf), GLINT_OK);
      const HalfVectorSample drawn = curved.sample(same, {0.3f, 0.7f});
      EXPECT_EQ(hx, drawn.h.x);
      EXPECT_EQ(pdf, drawn.pdf);
      lit += density > 0;
    }
    EXPECT_GT(lit, 2);
  }
}

TEST(CCurved, BatchesAnswerAsSingleQueries) {
  for (const char* kind : kKinds) {
    SCOPED_TRACE(kind);
    const Handle ndf = openHandle(kind);
    const Queries q(50);
    std::vector<float> sx, sy;
    for (std::size_t k = 0; k < q.u.size(); ++k) {
      sx.push_back(k % 5 == 0 ? 0 : k % 7 == 0 ? kNan : 0.01f * static_cast<float>(k % 9));
      sy.push_back(k % 5 == 0 ? 0 : 0.02f);
    }
    glint_footprints p = isotropic(q);
    p.spread_x = contiguous(sx), p.spread_y = contiguous(sy);
    std::vector<float> densities(q.u.size()), hx(q.u.size()), hy(q.u.size()), pdfs(q.u.size());
    ASSERT_EQ(glint_density_batch(ndf.get(), q.u.size(), &p, contiguous(q.hx), contiguous(q.hy), densities.data()), GLINT_OK);
    ASSERT_EQ(
        glint_sample_batch(ndf.get(), q.u.size(), &p, contiguous(q.v), contiguous(q.v), hx.data(), hy.data(), pdfs.data()),
        GLINT_OK);
    for (std::size_t k = 0; k < q.u.size(); ++k) {
      if (!(std::fabs(q.u[k]) < 2)) continue;  // floats in batches stand for other cells than doubles there
      const glint_footprint one = curvedAt(q.u[k], q.v[k], q.sigma[k], {sx[k], sy[k]});
      float density = -1, x = 0, y = 0, pdf = -1;
      glint_density(ndf.get(), &one, q.hx[k], q.hy[k], &density);
      if (k % 5 != 0) {
        EXPECT_NEAR(densities[k], density, kBatchError * (1 + density)) << k;
      }
      glint_sample(ndf.get(), &one, q.v[k], q.v[k], &x, &y, &pdf);
      EXPECT_NEAR(pdfs[k], pdf, 1e-4f * (1 + pdf)) << k;
    }
    p.spread_y = {};
    EXPECT_EQ(glint_density_batch(ndf.get(), 1, &p, contiguous(q.hx), contiguous(q.hy), densities.data()), GLINT_ERROR_USAGE);
  }
}

TEST(CCurved, IsTheAverageOverTheHalfVectorsOfThePixel) {
  glint_open_options options = GLINT_OPEN_OPTIONS_INIT;
  options.sigma_r = 0.02f;
  const Handle ndf = openHandle("normals", &options);
  constexpr int kPoints = 40;
  for (const Vec2 h : {Vec2{0, 0}, Vec2{0.1f, -0.05f}, Vec2{-0.2f, 0.1f}}) {
    const glint_footprint flat = glint_footprint_isotropic(0.3, 0.6, 2), curved = curvedAt(0.3f, 0.6f, 2, kSpread);
    double truth = 0;
    for (int j = 0; j < kPoints; ++j)
      for (int i = 0; i < kPoints; ++i) {
        const auto at = [](int k) { return 2 * (static_cast<float>(k) + 0.5f) / kPoints - 1; };
        float density = 0;
        glint_density(ndf.get(), &flat, h.x + kSpread.x * at(i), h.y + kSpread.y * at(j), &density);
        truth += double{density} / (kPoints * kPoints);
      }
    float answer = -1;
    glint_density(ndf.get(), &curved, h.x, h.y, &answer);
    EXPECT_NEAR(answer, truth, 0.02 * truth + 1e-3);
  }
}

TEST(CCurved, BrdfsAreThoseOfTheClass) {
  const auto opened = api::OpenedNdf::open(assets().path("ndf-cp"));
  const Handle ndf = openHandle("ndf-cp");
  glint_brdf* brdf = nullptr;
  ASSERT_EQ(glint_brdf_create(ndf.get(), nullptr, &brdf), GLINT_OK);
  const CurvedNdf<api::AnyNdf> curved(opened.model(), kSpread);
  const glint_footprint p = curvedAt(0.3f, 0.7f, 20, kSpread);
  const Footprint same = Footprint::isotropic({0.3f, 0.7f}, 20);
  const MicrofacetBrdf expected(curved, same, opened.masking(), Fresnel::mirror());
  test::Random random(4);
  std::vector<float> values;
  float u = 0.3f, v = 0.7f, sigma = 20;
  glint_footprints batch = {};
  batch.u = {&u, 0}, batch.v = {&v, 0}, batch.sigma = {&sigma, 0};
  batch.spread_x = {&kSpread.x, 0}, batch.spread_y = {&kSpread.y, 0};
  for (int k = 0; k < 60; ++k) {
    const Vec3 wo = random.above(0.1), wi = random.above(0.1);
    float f[3], pdf, direction[3], weight[3], drawn_pdf;
    const float i[3] = {wi.x, wi.y, wi.z}, o[3] = {wo.x, wo.y, wo.z};
    ASSERT_EQ(glint_brdf_evaluate(brdf, &p, i, o, f, &pdf), GLINT_OK);
    EXPECT_EQ(f[0], expected.evaluate(wi, wo).r);
    EXPECT_EQ(pdf, expected.pdf(wi, wo));
    const float xi = static_cast<float>(random.unit()), second = 0.4f;
    ASSERT_EQ(glint_brdf_sample(brdf, &p, o, xi, second, direction, weight, &drawn_pdf), GLINT_OK);
    EXPECT_EQ(drawn_pdf, expected.sample(wo, {xi, second}).pdf);
    const glint_directions in = {{&i[0], 0}, {&i[1], 0}, {&i[2], 0}}, out = {{&o[0], 0}, {&o[1], 0}, {&o[2], 0}};
    float batch_f[3], batch_pdf, batch_wi[3], batch_weight[3], batch_drawn;
    ASSERT_EQ(glint_brdf_evaluate_batch(brdf, 1, &batch, &in, &out, batch_f, &batch_pdf), GLINT_OK);
    EXPECT_NEAR(batch_f[0], f[0], kBatchError * (1 + f[0]));
    ASSERT_EQ(glint_brdf_sample_batch(brdf, 1, &batch, &out, {&xi, 0}, {&second, 0}, batch_wi, batch_weight, &batch_drawn),
              GLINT_OK);
    EXPECT_NEAR(batch_drawn, drawn_pdf, kBatchError * (1 + drawn_pdf));
  }
  glint_brdf_destroy(brdf);
}

TEST(CCurved, SpreadsAreThoseOfTheDifferentials) {
  const float wi[3] = {0.2f, -0.1f, 0.9746794f}, wo[3] = {0.1f, 0.3f, 0.9486833f}, dndx[3] = {0.02f, 0.001f, 0},
              dndy[3] = {0, 0.03f, 0}, dwodx[3] = {0.001f, 0, 0}, dwody[3] = {0, 0.002f, 0};
  glint_footprint p = glint_footprint_isotropic(0, 0, 3);
  EXPECT_EQ(p.spread[0], 0);
  ASSERT_EQ(glint_footprint_set_spread(&p, wi, wo, dndx, dndy, dwodx, dwody, 0.5f), GLINT_OK);
  const HalfVector h = halfVectorOf({wi[0], wi[1], wi[2]}, {wo[0], wo[1], wo[2]});
  const Vec2 expected = halfVectorSpread(halfVectorDifferential(h, {dndx[0], dndx[1], dndx[2]}, {dwodx[0], 0, 0}),
                                         halfVectorDifferential(h, {dndy[0], dndy[1], dndy[2]}, {0, dwody[1], 0}), 0.5f);
  EXPECT_EQ(p.spread[0], expected.x);
  EXPECT_EQ(p.spread[1], expected.y);
  EXPECT_GT(expected.y, 0.02f);
  // Without the eye's differentials, and with directions that are none.
  ASSERT_EQ(glint_footprint_set_spread(&p, wi, wo, dndx, dndy, nullptr, nullptr, 0.5f), GLINT_OK);
  EXPECT_GT(p.spread[0], 0);
  const float none[3] = {0, 0, 0};
  ASSERT_EQ(glint_footprint_set_spread(&p, none, none, dndx, dndy, nullptr, nullptr, 0.5f), GLINT_OK);
  EXPECT_EQ(p.spread[0], 0);
  EXPECT_EQ(glint_footprint_set_spread(nullptr, wi, wo, dndx, dndy, nullptr, nullptr, 0.5f), GLINT_ERROR_USAGE);
  EXPECT_EQ(glint_footprint_set_spread(&p, wi, wo, nullptr, dndy, nullptr, nullptr, 0.5f), GLINT_ERROR_USAGE);
}

}  // namespace
}  // namespace glint::c_curved_test
