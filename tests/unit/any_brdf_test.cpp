#include "glint/api/any_brdf.h"

#include <gtest/gtest.h>

#include <optional>
#include <type_traits>
#include <vector>

#include "glint/api/brdf_batch.h"
#include "glint/query/brdf/displaced_brdf.h"
#include "glint/query/light/environment.h"
#include "glint/query/packed_ndf_view.h"
#include "support/c_api.h"
#include "support/directions.h"

namespace glint::any_brdf_test {
namespace {

using api::AnyBrdf;
using api::AnyNdf;
using api::BrdfFacets;
using api::OpenedNdf;

// What refers to a model or to an asset refuses those that end with the statement.
static_assert(std::is_constructible_v<MicrofacetBrdf<AnyNdf>, const AnyNdf&, Footprint, SmithMasking, Fresnel>);
static_assert(!std::is_constructible_v<MicrofacetBrdf<AnyNdf>, AnyNdf, Footprint, SmithMasking, Fresnel>);
static_assert(!std::is_constructible_v<MicrofacetBrdf<AnyNdf>, const AnyNdf, Footprint, SmithMasking, Fresnel>);
static_assert(std::is_constructible_v<AnyBrdf, OpenedNdf&, Fresnel> && !std::is_constructible_v<AnyBrdf, OpenedNdf, Fresnel>);
static_assert(std::is_constructible_v<DisplacedBrdf, Displacement&> && !std::is_constructible_v<DisplacedBrdf, Displacement>);
static_assert(!std::is_constructible_v<PackedNdfView, PackedHeader, const void*>);

const Fresnel kCopper = Fresnel::conductor({0.2f, 0.92f, 1.1f}, {3.91f, 2.45f, 2.14f});
constexpr Vec2 kXi = {0.3f, 0.6f};

TEST(AnyNdf, AnswersAsTheModelThatItHolds) {
  for (const char* kind : test::kKinds) {
    const OpenedNdf opened = OpenedNdf::open(test::assets().path(kind));
    const AnyNdf& any = opened.model();
    const test::Queries q(50);
    for (std::size_t k = 0; k < q.u.size(); ++k) {
      const Footprint p = Footprint::isotropic({q.u[k], q.v[k]}, q.sigma[k]);
      const Vec2 h = {q.hx[k], q.hy[k]};
      const Box2 range = {h, h + Vec2{0.2f, 0.1f}};
      std::visit(
          [&](const auto& model) {
            EXPECT_EQ(any.density(p, h), model.density(p, h)) << kind;
            EXPECT_EQ(any.mean(p, range), model.mean(p, range)) << kind;
            EXPECT_EQ(any.sample(p, kXi).h, model.sample(p, kXi).h) << kind;
          },
          any);
    }
  }
}

TEST(AnyNdf, FitsWhereATemplateTakesAModel) {
  const OpenedNdf opened = OpenedNdf::open(test::assets().path("ndf-cp"));
  const Footprint p = Footprint::isotropic({0.3f, 0.7f}, 20);
  const MicrofacetBrdf brdf(opened.model(), p, opened.masking(), kCopper);
  const SphericalGaussian lamp = {test::direction(0.3, 1), 100, Rgb::grey(1)};
  EXPECT_GT(prefilteredRadiance(brdf, test::direction(0.4, 4), lamp).g, 0);
}

/// The BRDF of a model's class.
template <class Model>
auto brdfOf(const Model& model, const Footprint& p, const SmithMasking& masking) {
  if constexpr (WaveModel<Model>)
    return WaveBrdf(model, p, masking, kCopper);
  else
    return MicrofacetBrdf(model, p, masking, kCopper);
}

TEST(AnyBrdf, AnswersAsTheClassOfItsModel) {
  int lit = 0;
  for (const char* kind : test::kKinds) {
    const OpenedNdf opened = OpenedNdf::open(test::assets().path(kind));
    const AnyBrdf brdf(opened, kCopper);
    const SmithMasking masking(opened.slopes(), opened.info().sigma_r);
    const Vec3 wi = test::direction(0.7, 0.2), wo = test::direction(0.8, 3);
    const Footprint p = Footprint::isotropic({0.3f, 0.7f}, 20);
    std::visit(
        [&](const auto& model) {
          const auto same = brdfOf(model, p, masking);
          lit += same.evaluate(wi, wo).r > 0;
          EXPECT_EQ(brdf.evaluate(p, wi, wo), same.evaluate(wi, wo)) << kind;
          EXPECT_EQ(brdf.pdf(p, wi, wo), same.pdf(wi, wo)) << kind;
          EXPECT_EQ(brdf.evaluateWithPdf(p, wi, wo).pdf, same.pdf(wi, wo)) << kind;
          EXPECT_EQ(brdf.sample(p, wo, kXi).wi, same.sample(wo, kXi).wi) << kind;
        },
        opened.model());
  }
  EXPECT_GE(lit, 3);
}

TEST(AnyBrdf, OfBeckmannFacetsIsThatOfABinMap) {
  const OpenedNdf bins = OpenedNdf::open(test::assets().path("bin-map")), cp = OpenedNdf::open(test::assets().path("ndf-cp"));
  const AnyBrdf brdf(bins, kCopper, BrdfFacets::beckmann);
  const Footprint p = Footprint::isotropic({0.3f, 0.7f}, 20);
  const BinMapBrdf same(std::get<BinMapNdf>(bins.model()), p, kCopper);
  const Vec3 wi = test::direction(0.7, 0.2), wo = test::direction(0.8, 3);
  EXPECT_GT(same.evaluate(wi, wo).r, 0);
  EXPECT_EQ(brdf.evaluate(p, wi, wo), same.evaluate(wi, wo));
  EXPECT_EQ(brdf.sample(p, wo, kXi).wi, same.sample(wo, kXi).wi);
  try {
    const AnyBrdf refused(cp, kCopper, BrdfFacets::beckmann);
    ADD_FAILURE();
  } catch (const Error& error) {
    EXPECT_EQ(error.code(), ErrorCode::unsupported);
    EXPECT_NE(std::string(error.what()).find("ndf-cp"), std::string::npos);
  }
}

TEST(AnyBrdf, OutlivesAMoveOfItsAsset) {
  std::optional<OpenedNdf> opened(OpenedNdf::open(test::assets().path("ndf-pyramid")));
  const AnyBrdf brdf(*opened, kCopper);
  const Footprint p = Footprint::isotropic({0.3f, 0.7f}, 20);
  const Vec3 wi = test::direction(0.7, 0.2), wo = test::direction(0.8, 3);
  const Rgb before = brdf.evaluate(p, wi, wo);
  const OpenedNdf moved = std::move(*opened);
  opened.reset();
  EXPECT_EQ(brdf.evaluate(p, wi, wo), before);
}

TEST(AnyBrdf, BatchesAnswerAsSingleQueries) {
  constexpr float kBatchError = 1e-6f;  // batches may sum in another order
  constexpr std::size_t kCount = 40;
  const OpenedNdf opened = OpenedNdf::open(test::assets().path("ndf-pyramid"));
  const AnyBrdf brdf(opened, kCopper);
  const test::Queries q(kCount);
  api::FootprintArrays footprints;
  footprints.u = {q.u.data()}, footprints.v = {q.v.data()}, footprints.sigma = {q.sigma.data()};
  const Vec3 wi = test::direction(0.7, 0.2), wo = test::direction(0.8, 3);
  const auto same = [](const Vec3& w) { return api::DirectionArrays{{&w.x, 0}, {&w.y, 0}, {&w.z, 0}}; };
  std::vector<float> f(3 * kCount), pdfs(kCount);
  api::brdfValues(brdf, kCount, footprints, same(wi), same(wo), {f.data(), pdfs.data()});
  for (std::size_t k = 0; k < kCount; ++k) {
    const BrdfValue one = brdf.evaluateWithPdf(footprints[k], wi, wo);
    EXPECT_NEAR(f[3 * k + 1], one.f.g, kBatchError * one.f.g);
    EXPECT_NEAR(pdfs[k], one.pdf, kBatchError * one.pdf);
  }
}

}  // namespace
}  // namespace glint::any_brdf_test
