// What the C interface does with handles that are closed, and what a caller of C has besides questions.

#include <gtest/gtest.h>

#include <cstring>
#include <string>
#include <vector>

#include "glint.h"
#include "glint/api/any_brdf.h"
#include "glint/api/pack.h"
#include "glint/query/light/environment.h"
#include "glint/query/ray_footprint.h"
#include "support/c_api.h"
#include "support/directions.h"

namespace glint::c_handles_test {
namespace {

using namespace test;

constexpr glint_status kUsage = GLINT_ERROR_USAGE;

void expectClosed(glint_status status, const char* name) {
  EXPECT_EQ(status, kUsage) << name;
  EXPECT_EQ(std::string(glint_error_message()), std::string(name) + " is closed, or of another kind");
}

glint_ndf* opened(const char* kind) {
  glint_ndf* ndf = nullptr;
  EXPECT_EQ(glint_ndf_open(assets().path(kind).c_str(), nullptr, &ndf), GLINT_OK) << glint_error_message();
  return ndf;
}

TEST(CHandles, AskingAClosedDistributionIsAnError) {
  const glint_footprint p = glint_footprint_isotropic(0.3, 0.7, 20);
  glint_ndf* ndf = opened("ndf-cp");
  glint_ndf_close(ndf);
  glint_ndf_close(ndf);
  float a = -7, b = -7, c[3] = {-7, -7, -7};
  std::size_t size = 7;
  glint_ndf_info info = {};
  info.struct_size = sizeof info;
  glint_brdf* brdf = nullptr;
  glint_footprints footprints = {};
  const float zero = 0;
  footprints.u = footprints.v = footprints.sigma = {&zero, 0};
  expectClosed(glint_density(ndf, &p, 0, 0, &a), "glint_density: ndf");
  expectClosed(glint_mean(ndf, &p, 0, 0, 1, 1, &a), "glint_mean: ndf");
  expectClosed(glint_sample(ndf, &p, 0, 0, &a, &b, c), "glint_sample: ndf");
  expectClosed(glint_density_batch(ndf, 1, &footprints, {&zero, 0}, {&zero, 0}, &a), "glint_density_batch: ndf");
  expectClosed(glint_mean_batch(ndf, 1, &footprints, {&zero, 0}, {&zero, 0}, {&zero, 0}, {&zero, 0}, &a),
               "glint_mean_batch: ndf");
  expectClosed(glint_sample_batch(ndf, 1, &footprints, {&zero, 0}, {&zero, 0}, &a, &b, c), "glint_sample_batch: ndf");
  expectClosed(glint_ndf_get_info(ndf, &info), "glint_ndf_get_info: ndf");
  expectClosed(glint_ndf_slopes(ndf, c, c), "glint_ndf_slopes: ndf");
  expectClosed(glint_ndf_pack(ndf, nullptr, 0, &size), "glint_ndf_pack: ndf");
  expectClosed(glint_brdf_create(ndf, nullptr, &brdf), "glint_brdf_create: ndf");
  EXPECT_EQ(a, -7);
  EXPECT_EQ(c[0], -7);
  EXPECT_EQ(size, 7u);
  EXPECT_EQ(brdf, nullptr);
}

TEST(CHandles, ABrdfKeepsItsDistributionAndIsItselfClosedOnce) {
  const glint_footprint p = glint_footprint_isotropic(0.3, 0.7, 20);
  glint_ndf* ndf = opened("ndf-pyramid");
  glint_brdf *brdf = nullptr, *second = nullptr;
  ASSERT_EQ(glint_brdf_create(ndf, nullptr, &brdf), GLINT_OK);
  ASSERT_EQ(glint_brdf_create(ndf, nullptr, &second), GLINT_OK);
  const float wi[3] = {0.1f, 0.2f, 0.9746794f}, wo[3] = {-0.2f, 0, 0.9797959f};
  float before[3], after[3], pdf = 0;
  ASSERT_EQ(glint_brdf_evaluate(brdf, &p, wi, wo, before, &pdf), GLINT_OK);
  glint_ndf_close(ndf);
  ASSERT_EQ(glint_brdf_evaluate(brdf, &p, wi, wo, after, &pdf), GLINT_OK);
  EXPECT_GT(before[0], 0);
  EXPECT_EQ(before[0], after[0]);
  glint_brdf_destroy(brdf);
  glint_brdf_destroy(brdf);
  expectClosed(glint_brdf_evaluate(brdf, &p, wi, wo, after, &pdf), "glint_brdf_evaluate: brdf");
  ASSERT_EQ(glint_brdf_evaluate(second, &p, wi, wo, after, &pdf), GLINT_OK);
  glint_brdf_destroy(second);
}

TEST(CHandles, AHandleOfAnotherKindIsAnError) {
  glint_ndf* ndf = opened("ndf-pyramid");
  float level = 0, a = 0;
  expectClosed(glint_displaced_level(reinterpret_cast<glint_displaced*>(ndf), 1, &level), "glint_displaced_level: displaced");
  glint_displaced_close(reinterpret_cast<glint_displaced*>(ndf));  // ignored
  const glint_footprint p = glint_footprint_isotropic(0.3, 0.7, 20);
  EXPECT_EQ(glint_density(ndf, &p, 0, 0, &a), GLINT_OK);
  glint_ndf_close(ndf);
  glint_displaced* displaced = nullptr;
  ASSERT_EQ(glint_displaced_open(assets().path("displacement").c_str(), 0, &displaced), GLINT_OK);
  EXPECT_EQ(glint_displaced_level(displaced, 1, &level), GLINT_OK);
  glint_displaced_close(displaced);
  glint_displaced_close(displaced);
  expectClosed(glint_displaced_level(displaced, 1, &level), "glint_displaced_level: displaced");
}

TEST(CApi, FootprintsOfBoxesAndConesAreThoseOfCpp) {
  const glint_footprint box = glint_footprint_box(0.1, 0.2, 1, 2, 3, 4);
  EXPECT_EQ(box.kind, GLINT_FOOTPRINT_BOX);
  EXPECT_EQ(box.m[1], 2);
  EXPECT_EQ(box.m[2], 3);
  const glint_ray_cone cone = glint_ray_cone_bounced(glint_ray_cone_propagated({0.01f, 0.002f}, 3), 0.2f);
  const RayCone same = bounced(propagated({0.01f, 0.002f}, 3), 0.2f);
  EXPECT_EQ(cone.width, same.width);
  EXPECT_EQ(cone.spread, same.spread);
  const float direction[3] = {0.6f, 0, 0.8f};
  const glint_footprint seen = glint_footprint_from_cone(cone, 0.1, 0.2, direction, 500);
  const Footprint expected = footprintOfCone(same, {}, {0.6f, 0, 0.8f}, 500);
  EXPECT_EQ(seen.u, 0.1);
  EXPECT_EQ(seen.m[0], expected.covariance.xx);
  EXPECT_EQ(seen.m[2], expected.covariance.yy);
  EXPECT_EQ(glint_footprint_from_cone(cone, 0, 0, nullptr, 500).m[0], footprintOfCone(same, {}, {0, 0, 1}, 500).covariance.xx);
}

TEST(CApi, SlopesAreThoseOfTheAsset) {
  for (const char* kind : kKinds) {
    const MapSlopes expected = api::OpenedNdf::open(assets().path(kind)).slopes();
    const Handle ndf = openHandle(kind);
    float mean[2] = {-7, -7}, covariance[3] = {-7, -7, -7};
    ASSERT_EQ(glint_ndf_slopes(ndf.get(), mean, covariance), GLINT_OK);
    EXPECT_EQ(mean[1], expected.mean.y) << kind;
    EXPECT_EQ(covariance[0], expected.covariance.xx) << kind;
    EXPECT_EQ(covariance[1], expected.covariance.xy) << kind;
    EXPECT_EQ(covariance[2], expected.covariance.yy) << kind;
  }
}

TEST(CApi, PacksEveryKindThatCppPacks) {
  api::NdfModels::forEach([&]<class Model>(std::type_identity<Model>) {
    const std::string kind(api::NdfTraits<Model>::kKind);
    const Handle ndf = openHandle(kind);
    std::size_t size = 0;
    if (!api::NdfTraits<Model>::kPacks) {
      EXPECT_EQ(glint_ndf_pack(ndf.get(), nullptr, 0, &size), GLINT_ERROR_UNSUPPORTED) << kind;
      return;
    }
    const std::vector<std::byte> expected = api::pack(api::OpenedNdf::open(assets().path(kind)));
    ASSERT_EQ(glint_ndf_pack(ndf.get(), nullptr, 0, &size), GLINT_OK) << kind;
    ASSERT_EQ(size, expected.size());
    std::vector<std::byte> bytes(size);
    EXPECT_EQ(glint_ndf_pack(ndf.get(), bytes.data(), size - 1, &size), kUsage);
    EXPECT_EQ(bytes[0], std::byte{0});
    ASSERT_EQ(glint_ndf_pack(ndf.get(), bytes.data(), size, &size), GLINT_OK);
    EXPECT_EQ(bytes, expected) << kind;
  });
}

/// A few lobes around a view, and one that gives no light.
std::vector<SphericalGaussian> lamps() {
  return {{test::direction(0.9, 1), 40, {1, 2, 3}}, {test::direction(0.6, 4), 300, {5, 5, 1}}, {{0, 0, 2}, 10, {1, 1, 1}}};
}

std::vector<glint_spherical_gaussian> given(const std::vector<SphericalGaussian>& lobes) {
  std::vector<glint_spherical_gaussian> out;
  for (const SphericalGaussian& g : lobes)
    out.push_back({{g.axis.x, g.axis.y, g.axis.z}, g.sharpness, {g.amplitude.r, g.amplitude.g, g.amplitude.b}});
  return out;
}

TEST(CApi, LobesOfLightAreReflectedAndSampledAsInCpp) {
  const auto asset = api::OpenedNdf::open(assets().path("ndf-cp"));
  const api::AnyBrdf same(asset, Fresnel::mirror());
  const Footprint at = Footprint::isotropic({0.3f, 0.7f}, 20);
  const MicrofacetBrdf brdf(asset.model(), at, same.masking(), Fresnel::mirror());
  const Vec3 wo = test::direction(0.8, 3);
  const std::vector<SphericalGaussian> lobes = lamps();
  const SphericalGaussians lights = {lobes.data(), lobes.size()};
  std::vector<float> expected_shares(lobes.size()), shares(lobes.size());
  const LightSampler sampler(brdf, wo, lights, expected_shares.data());

  const Handle ndf = openHandle("ndf-cp");
  glint_brdf* c_brdf = nullptr;
  ASSERT_EQ(glint_brdf_create(ndf.get(), nullptr, &c_brdf), GLINT_OK);
  const auto c_lobes = given(lobes);
  const glint_footprint p = glint_footprint_isotropic(static_cast<double>(0.3f), static_cast<double>(0.7f), 20);
  const float c_wo[3] = {wo.x, wo.y, wo.z};
  float radiance[3], wi[3], pdf = -1;
  ASSERT_EQ(glint_lobes_reflected(c_brdf, &p, c_wo, c_lobes.data(), c_lobes.size(), 0, radiance), GLINT_OK);
  EXPECT_EQ(radiance[2], prefilteredRadiance(brdf, wo, lights).b);
  EXPECT_GT(radiance[2], 0);
  ASSERT_EQ(glint_lobes_shares(c_brdf, &p, c_wo, c_lobes.data(), c_lobes.size(), shares.data()), GLINT_OK);
  EXPECT_EQ(shares, expected_shares);
  ASSERT_EQ(glint_lobes_sample(c_lobes.data(), c_lobes.size(), shares.data(), 0.3f, 0.6f, wi, radiance, &pdf), GLINT_OK);
  const LightSample drawn = sampler.sample({0.3f, 0.6f});
  EXPECT_EQ(wi[0], drawn.wi.x);
  EXPECT_EQ(radiance[1], drawn.radiance.g);
  EXPECT_EQ(pdf, drawn.pdf);
  float again[3], again_pdf = -1;
  ASSERT_EQ(glint_lobes_evaluate(c_lobes.data(), c_lobes.size(), shares.data(), wi, again, &again_pdf), GLINT_OK);
  EXPECT_EQ(again[1], radiance[1]);
  EXPECT_EQ(again_pdf, pdf);
  EXPECT_EQ(glint_lobes_reflected(c_brdf, &p, c_wo, c_lobes.data(), c_lobes.size(), 9, radiance), kUsage);
  EXPECT_EQ(glint_lobes_reflected(c_brdf, &p, c_wo, nullptr, 1, 0, radiance), kUsage);
  EXPECT_EQ(glint_lobes_reflected(c_brdf, &p, c_wo, nullptr, 0, 0, radiance), GLINT_OK);
  EXPECT_EQ(radiance[0], 0);
  glint_brdf_destroy(c_brdf);
}

TEST(CApi, LobesWithoutLightDrawNothing) {
  const Handle ndf = openHandle("ndf-pyramid");
  glint_brdf* brdf = nullptr;
  ASSERT_EQ(glint_brdf_create(ndf.get(), nullptr, &brdf), GLINT_OK);
  const glint_footprint p = glint_footprint_isotropic(0.3, 0.7, 20);
  const glint_spherical_gaussian dark[2] = {{{0, 0, 1}, 10, {0, 0, 0}}, {{0, 0, 3}, 10, {1, 1, 1}}};
  const float wo[3] = {0, 0, 1};
  float shares[2] = {-1, -1}, wi[3], radiance[3], pdf = -1;
  ASSERT_EQ(glint_lobes_shares(brdf, &p, wo, dark, 2, shares), GLINT_OK);
  ASSERT_EQ(glint_lobes_sample(dark, 2, shares, 0.3f, 0.6f, wi, radiance, &pdf), GLINT_OK);
  EXPECT_EQ(pdf, 0);
  glint_brdf_destroy(brdf);
}

TEST(CApi, BeckmannFacetsHaveNoAveragesOverLobes) {
  glint_brdf_options options = GLINT_BRDF_OPTIONS_INIT;
  options.facets = GLINT_FACETS_BECKMANN;
  const Handle ndf = openHandle("bin-map");
  glint_brdf* brdf = nullptr;
  ASSERT_EQ(glint_brdf_create(ndf.get(), &options, &brdf), GLINT_OK);
  const glint_footprint p = glint_footprint_isotropic(0.3, 0.7, 20);
  const auto lobes = given(lamps());
  const float wo[3] = {0, 0, 1};
  float radiance[3] = {-7, -7, -7};
  EXPECT_EQ(glint_lobes_reflected(brdf, &p, wo, lobes.data(), lobes.size(), 0, radiance), kUsage);
  EXPECT_EQ(radiance[0], -7);
  glint_brdf_destroy(brdf);
}

TEST(CApi, PositionsFarOutAreThoseOfTheMap) {
  // The same texels 4096 maps away: in floats the density would be off by percents.
  for (const std::string kind : kKinds) {
    if (kind == "wang-pyramid" || kind == "wang-cp") continue;  // their tiles differ, so the plane does not repeat
    const Handle ndf = openHandle(kind.c_str());
    for (int k = 0; k < 20; ++k) {
      const double u = 0.013 + 0.05 * k, v = 0.871 - 0.04 * k, far_u = u + 4096, far_v = v - 4096;
      const glint_footprint near = glint_footprint_isotropic(u, v, 1.5f), far = glint_footprint_isotropic(far_u, far_v, 1.5f);
      float expected = 0, single = 0, batch = 0;
      glint_density(ndf.get(), &near, 0.02f, 0.03f, &expected);
      glint_density(ndf.get(), &far, 0.02f, 0.03f, &single);
      EXPECT_NEAR(single, expected, 1e-5f * expected) << kind;
      const float sigma = 1.5f, hx = 0.02f, hy = 0.03f;
      glint_footprints p = {};
      p.precise_u = {&far_u, 0}, p.precise_v = {&far_v, 0}, p.sigma = {&sigma, 0};
      ASSERT_EQ(glint_density_batch(ndf.get(), 1, &p, {&hx, 0}, {&hy, 0}, &batch), GLINT_OK);
      EXPECT_NEAR(batch, expected, 1e-5f * expected) << kind;
    }
  }
}

}  // namespace
}  // namespace glint::c_handles_test
