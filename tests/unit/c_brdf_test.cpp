#include <gtest/gtest.h>

#include <array>
#include <cmath>
#include <cstring>
#include <memory>
#include <string>
#include <type_traits>
#include <vector>

#include "glint.h"
#include "glint/api/any_ndf.h"
#include "glint/query/brdf/bin_map_brdf.h"
#include "glint/query/brdf/displaced_brdf.h"
#include "glint/query/brdf/microfacet_brdf.h"
#include "glint/query/brdf/wave_brdf.h"
#include "support/c_api.h"
#include "support/directions.h"
#include "support/hdf5_bytes.h"

namespace glint::c_brdf_test {
namespace {

using namespace test;

/// Batches may sum in another order; f and the pdf are products of the density with some ten factors.
constexpr float kBatchError = 1e-6f;

using Triple = std::array<float, 3>;
Triple tripleOf(Vec3 w) { return {w.x, w.y, w.z}; }
Triple tripleOf(Rgb c) { return {c.r, c.g, c.b}; }

glint_brdf_options gold() {
  return {sizeof(glint_brdf_options), GLINT_FRESNEL_CONDUCTOR, 0, {0.18f, 0.42f, 1.37f}, {3.42f, 2.35f, 1.77f}};
}
const Fresnel kGold = Fresnel::conductor({0.18f, 0.42f, 1.37f}, {3.42f, 2.35f, 1.77f});

struct BrdfCloser {
  void operator()(glint_brdf* brdf) const { glint_brdf_destroy(brdf); }
};
using BrdfHandle = std::unique_ptr<glint_brdf, BrdfCloser>;

BrdfHandle brdfOf(const Handle& ndf, const glint_brdf_options& options) {
  glint_brdf* brdf = nullptr;
  EXPECT_EQ(glint_brdf_create(ndf.get(), &options, &brdf), GLINT_OK) << glint_error_message();
  return BrdfHandle(brdf);
}

/// Random directions above the surface, most of them near the mirror direction of another, with a few that are none.
struct Directions {
  Directions(std::size_t count, unsigned seed) {
    test::Random random(seed);
    for (std::size_t k = 0; k < count; ++k) {
      const Vec3 o = random.above(0.05);
      Vec3 i = {-o.x + 0.4f * random.unit() - 0.2f, -o.y + 0.4f * random.unit() - 0.2f, o.z};
      i = 1 / std::sqrt(dot(i, i)) * i;
      if (k % 11 == 3) i = {o.x, o.y, -o.z};
      if (k % 13 == 5) i.x = kNan;
      if (k % 17 == 7) i = {3, 4, 5};
      wi.push_back(tripleOf(i)), wo.push_back(tripleOf(o));
    }
  }
  static glint_directions arrays(const std::vector<Triple>& w) {
    return {{&w[0][0], sizeof(Triple)}, {&w[0][1], sizeof(Triple)}, {&w[0][2], sizeof(Triple)}};
  }
  std::vector<Triple> wi, wo;
};

/// The BRDF of a model's class.
template <class Model>
auto classOf(const Model& model, const Footprint& p, const SmithMasking& masking) {
  if constexpr (WaveModel<Model>)
    return WaveBrdf(model, p, masking, kGold);
  else
    return MicrofacetBrdf(model, p, masking, kGold);
}

TEST(CBrdf, AnswersAsTheClassDoes) {
  for (const char* kind : kKinds) {
    SCOPED_TRACE(kind);
    const auto opened = api::OpenedNdf::open(assets().path(kind));
    const SmithMasking masking(opened.slopes(), opened.info().sigma_r);
    const Handle ndf = openHandle(kind);
    const BrdfHandle brdf = brdfOf(ndf, gold());
    const Queries q(200);
    const Directions d(200, 3);
    int lit = 0, drawn = 0;
    for (std::size_t k = 0; k < q.u.size(); ++k) {
      const glint_footprint p = glint_footprint_isotropic(q.u[k], q.v[k], q.sigma[k]);
      const Vec3 wi = {d.wi[k][0], d.wi[k][1], d.wi[k][2]}, wo = {d.wo[k][0], d.wo[k][1], d.wo[k][2]};
      Triple f{-1, -1, -1}, direction{}, weight{};
      float pdf = -1, sample_pdf = -1, u1 = 0.3f, u2 = std::fabs(d.wo[k][0]);
      ASSERT_EQ(glint_brdf_evaluate(brdf.get(), &p, d.wi[k].data(), d.wo[k].data(), f.data(), &pdf), GLINT_OK);
      ASSERT_EQ(glint_brdf_sample(brdf.get(), &p, d.wo[k].data(), u1, u2, direction.data(), weight.data(), &sample_pdf),
                GLINT_OK);
      std::visit(
          [&](const auto& model) {
            const auto same = classOf(model, Footprint::isotropic({q.u[k], q.v[k]}, q.sigma[k]), masking);
            EXPECT_EQ(f, tripleOf(same.evaluate(wi, wo))) << k;
            EXPECT_EQ(pdf, same.pdf(wi, wo));
            const BrdfSample s = same.sample(wo, {u1, u2});
            EXPECT_EQ(direction, tripleOf(s.wi));
            EXPECT_EQ(sample_pdf, s.pdf);
            EXPECT_EQ(weight, tripleOf(s.weight));
          },
          opened.model());
      lit += f[0] > 0, drawn += sample_pdf > 0;
    }
    EXPECT_GT(lit, 20);
    EXPECT_GT(drawn, 20);
  }
}

TEST(CBrdf, OfBeckmannFacetsAnswersAsTheClassDoes) {
  const auto bins = test::sampleBinMap(kSize, kSize);
  glint_brdf_options options = gold();
  options.facets = GLINT_FACETS_BECKMANN;
  const Handle ndf = openHandle("bin-map");
  const BrdfHandle brdf = brdfOf(ndf, options);
  const Queries q(200);
  const Directions d(200, 4);
  int lit = 0;
  for (std::size_t k = 0; k < q.u.size(); ++k) {
    const BinMapBrdf same(BinMapNdf(bins.map), Footprint::isotropic({q.u[k], q.v[k]}, q.sigma[k]), kGold);
    const glint_footprint p = glint_footprint_isotropic(q.u[k], q.v[k], q.sigma[k]);
    const Vec3 wi = {d.wi[k][0], d.wi[k][1], d.wi[k][2]}, wo = {d.wo[k][0], d.wo[k][1], d.wo[k][2]};
    Triple f{}, direction{}, weight{};
    float pdf = -1, sample_pdf = -1;
    ASSERT_EQ(glint_brdf_evaluate(brdf.get(), &p, d.wi[k].data(), d.wo[k].data(), f.data(), &pdf), GLINT_OK);
    ASSERT_EQ(glint_brdf_sample(brdf.get(), &p, d.wo[k].data(), 0.3f, 0.6f, direction.data(), weight.data(), &sample_pdf),
              GLINT_OK);
    EXPECT_EQ(f, tripleOf(same.evaluate(wi, wo)));
    EXPECT_EQ(pdf, same.pdf(wi, wo));
    const BrdfSample s = same.sample(wo, {0.3f, 0.6f});
    EXPECT_EQ(direction, tripleOf(s.wi));
    EXPECT_EQ(weight, tripleOf(s.weight));
    EXPECT_EQ(sample_pdf, s.pdf);
    lit += f[0] > 0;
  }
  EXPECT_GT(lit, 20);
  glint_brdf* none = nullptr;
  EXPECT_EQ(glint_brdf_create(openHandle("ndf-cp").get(), &options, &none), GLINT_ERROR_UNSUPPORTED);
  EXPECT_NE(std::string(glint_error_message()).find("ndf-cp"), std::string::npos);
  EXPECT_EQ(none, nullptr);
}

TEST(CBrdf, FresnelIsThatOfTheMaterial) {
  const Handle ndf = openHandle("ndf-pyramid");
  const glint_footprint p = glint_footprint_isotropic(0.2f, 0.3f, 20);
  const Vec3 wi = test::direction(0.7, 0.2), wo = test::direction(0.8, 3);
  const float cosine = halfVectorOf(wi, wo).towards;
  const auto ask = [&](const glint_brdf_options& options) {
    Triple f{};
    const BrdfHandle brdf = brdfOf(ndf, options);
    EXPECT_EQ(glint_brdf_evaluate(brdf.get(), &p, tripleOf(wi).data(), tripleOf(wo).data(), f.data(), nullptr), GLINT_OK);
    return f;
  };
  const Triple mirror = ask(GLINT_BRDF_OPTIONS_INIT);
  ASSERT_GT(mirror[0], 0);
  glint_brdf_options glass = GLINT_BRDF_OPTIONS_INIT;
  glass.fresnel = GLINT_FRESNEL_DIELECTRIC;
  glass.eta[0] = 1.5f;
  const Triple dielectric = ask(glass), conductor = ask(gold());
  EXPECT_FLOAT_EQ(dielectric[2], mirror[2] * fresnelDielectric(cosine, 1.5f));
  EXPECT_FLOAT_EQ(conductor[0], mirror[0] * fresnelConductor(cosine, 0.18f, 3.42f));
  EXPECT_FLOAT_EQ(conductor[2], mirror[2] * fresnelConductor(cosine, 1.37f, 1.77f));
  glint_brdf* defaults = nullptr;
  ASSERT_EQ(glint_brdf_create(ndf.get(), nullptr, &defaults), GLINT_OK);
  Triple f{};
  glint_brdf_evaluate(defaults, &p, tripleOf(wi).data(), tripleOf(wo).data(), f.data(), nullptr);
  glint_brdf_destroy(defaults);
  EXPECT_EQ(f, mirror);
}

TEST(CBrdf, BatchesEqualSingleQueries) {
  for (const char* kind : kKinds) {
    for (const int facets : {GLINT_FACETS_OF_DISTRIBUTION, GLINT_FACETS_BECKMANN}) {
      if (facets == GLINT_FACETS_BECKMANN && std::string(kind) != "bin-map") continue;
      SCOPED_TRACE(kind);
      glint_brdf_options options = gold();
      options.facets = facets;
      const Handle ndf = openHandle(kind);
      const BrdfHandle brdf = brdfOf(ndf, options);
      for (const std::size_t count : {std::size_t{1}, std::size_t{300}}) {  // more than one part of a batch
        const Queries q(count);
        const Directions d(count, 5);
        const glint_footprints p = isotropic(q);
        const glint_directions wi = Directions::arrays(d.wi), wo = Directions::arrays(d.wo);
        std::vector<float> f(3 * count, -1), alone(3 * count, -1), pdfs(count, -1), pdfs_alone(count, -1);
        std::vector<float> drawn(3 * count), weights(3 * count), drawn_pdfs(count);
        ASSERT_EQ(glint_brdf_evaluate_batch(brdf.get(), count, &p, &wi, &wo, f.data(), pdfs.data()), GLINT_OK);
        ASSERT_EQ(glint_brdf_evaluate_batch(brdf.get(), count, &p, &wi, &wo, alone.data(), nullptr), GLINT_OK);
        ASSERT_EQ(glint_brdf_evaluate_batch(brdf.get(), count, &p, &wi, &wo, nullptr, pdfs_alone.data()), GLINT_OK);
        ASSERT_EQ(glint_brdf_sample_batch(brdf.get(), count, &p, &wo, contiguous(q.v), contiguous(q.u), drawn.data(),
                                          weights.data(), drawn_pdfs.data()),
                  GLINT_OK);
        EXPECT_EQ(f, alone);
        EXPECT_EQ(pdfs, pdfs_alone);
        for (std::size_t k = 0; k < count; ++k) {
          const glint_footprint one = glint_footprint_isotropic(q.u[k], q.v[k], q.sigma[k]);
          Triple value{}, direction{}, weight{};
          float pdf = -1;
          glint_brdf_evaluate(brdf.get(), &one, d.wi[k].data(), d.wo[k].data(), value.data(), &pdf);
          for (std::size_t c = 0; c < 3; ++c) EXPECT_NEAR(f[3 * k + c], value[c], kBatchError * value[c]) << k;
          EXPECT_NEAR(pdfs[k], pdf, kBatchError * pdf);
          glint_brdf_sample(brdf.get(), &one, d.wo[k].data(), q.v[k], q.u[k], direction.data(), weight.data(), &pdf);
          EXPECT_EQ(std::memcmp(&drawn[3 * k], direction.data(), sizeof direction), 0) << k;
          for (std::size_t c = 0; c < 3; ++c) EXPECT_NEAR(weights[3 * k + c], weight[c], 2 * kBatchError * weight[c]) << k;
          EXPECT_NEAR(drawn_pdfs[k], pdf, kBatchError * pdf) << k;
        }
      }
    }
  }
}

TEST(CBrdf, SamplesAreThoseOfThePdfAndWeighWhatIsReflected) {
  constexpr float kRounding =
      2e-3f;  // of the half vector found again from wi; compressed images integrate to 1 in half precision
  for (const char* kind : kKinds) {
    SCOPED_TRACE(kind);
    const Handle ndf = openHandle(kind);
    const BrdfHandle brdf = brdfOf(ndf, gold());
    const glint_footprint p = glint_footprint_isotropic(0.2f, 0.3f, 12);
    test::Random random(7);
    int drawn = 0, other = 0;
    for (int k = 0; k < 200; ++k) {
      const Triple wo = tripleOf(random.above(0.3));
      Triple wi{}, weight{}, f{};
      float drawn_pdf = 0, pdf = 0;
      glint_brdf_sample(brdf.get(), &p, wo.data(), random.unit(), random.unit(), wi.data(), weight.data(), &drawn_pdf);
      if (drawn_pdf == 0) continue;
      glint_brdf_evaluate(brdf.get(), &p, wi.data(), wo.data(), f.data(), &pdf);
      ++drawn;
      other += std::fabs(pdf / drawn_pdf - 1) > kRounding || std::fabs(f[0] * wi[2] / drawn_pdf - weight[0]) > kRounding;
    }
    EXPECT_GT(drawn, 60);  // steep facets reflect below the surface
    EXPECT_LE(other, 2);   // half vectors that rounding moves across the border of a bin
  }
}

TEST(CBrdf, BadInputHasDefinedAnswers) {
  const Handle ndf = openHandle("bin-map");
  for (const int facets : {GLINT_FACETS_OF_DISTRIBUTION, GLINT_FACETS_BECKMANN}) {
    glint_brdf_options options = gold();
    options.facets = facets;
    const BrdfHandle brdf = brdfOf(ndf, options);
    const glint_footprint p = glint_footprint_isotropic(kNan, 1e30f, kNan);
    const Triple good{0.6f, 0, 0.8f};
    Triple f{-7, -7, -7}, wi{-7, -7, -7};
    float pdf = -7;
    for (const Triple& bad : {Triple{0, 0, -1}, {1, 0, 0}, {0, 0, 0}, {kNan, 0, 1}, {3, 4, 5}}) {
      EXPECT_EQ(glint_brdf_evaluate(brdf.get(), &p, bad.data(), good.data(), f.data(), &pdf), GLINT_OK);
      EXPECT_EQ(f, (Triple{0, 0, 0}));
      EXPECT_EQ(pdf, 0);
      EXPECT_EQ(glint_brdf_sample(brdf.get(), &p, bad.data(), 0.5f, 0.5f, wi.data(), f.data(), &pdf), GLINT_OK);
      EXPECT_EQ(wi, (Triple{0, 0, 0}));
      EXPECT_EQ(f, (Triple{0, 0, 0}));
      EXPECT_EQ(pdf, 0);
    }
    for (const float xi : {kNan, -3.0f, 7.0f}) {
      EXPECT_EQ(glint_brdf_sample(brdf.get(), &p, good.data(), xi, xi, wi.data(), f.data(), &pdf), GLINT_OK);
      EXPECT_TRUE(std::isfinite(pdf) && pdf >= 0 && std::isfinite(f[0]) && std::isfinite(wi[2]));
    }
  }
}

/// Outputs of calls that must be refused and leave them as they are.
struct Untouched {
  Triple out{-7, -7, -7}, out2 = out;
  float pdf = -7;

  void operator()(glint_status status) const {
    EXPECT_EQ(status, GLINT_ERROR_USAGE);
    EXPECT_STREQ(glint_error_rule(), "api.arguments");
    EXPECT_EQ(out, (Triple{-7, -7, -7}));
    EXPECT_EQ(out2, out);
    EXPECT_EQ(pdf, -7);
  }
};

TEST(CBrdf, MissingArgumentsAreRefused) {
  const Handle ndf = openHandle("bin-map");
  const BrdfHandle brdf = brdfOf(ndf, gold());
  const glint_footprint p = glint_footprint_isotropic(0, 0, 1);
  const Triple w{0, 0, 1};
  Untouched refused;
  auto& [out, out2, pdf] = refused;
  refused(glint_brdf_evaluate(nullptr, &p, w.data(), w.data(), out.data(), &pdf));
  refused(glint_brdf_evaluate(brdf.get(), nullptr, w.data(), w.data(), out.data(), &pdf));
  refused(glint_brdf_evaluate(brdf.get(), &p, nullptr, w.data(), out.data(), &pdf));
  refused(glint_brdf_evaluate(brdf.get(), &p, w.data(), nullptr, out.data(), &pdf));
  refused(glint_brdf_evaluate(brdf.get(), &p, w.data(), w.data(), nullptr, nullptr));
  refused(glint_brdf_sample(nullptr, &p, w.data(), 0, 0, out.data(), out2.data(), &pdf));
  refused(glint_brdf_sample(brdf.get(), &p, nullptr, 0, 0, out.data(), out2.data(), &pdf));
  refused(glint_brdf_sample(brdf.get(), &p, w.data(), 0, 0, out.data(), nullptr, &pdf));
  const Queries q(1);
  const Directions d(1, 1);
  const glint_footprints arrays = isotropic(q);
  const glint_directions whole = Directions::arrays(d.wo);
  glint_directions flat = whole;
  flat.z.data = nullptr;
  const glint_floats xi = contiguous(q.u), none = {nullptr, 4};
  refused(glint_brdf_evaluate_batch(nullptr, 1, &arrays, &whole, &whole, out.data(), &pdf));
  refused(glint_brdf_evaluate_batch(brdf.get(), 1, nullptr, &whole, &whole, out.data(), &pdf));
  refused(glint_brdf_evaluate_batch(brdf.get(), 1, &arrays, nullptr, &whole, out.data(), &pdf));
  refused(glint_brdf_evaluate_batch(brdf.get(), 1, &arrays, &whole, &flat, out.data(), &pdf));
  refused(glint_brdf_evaluate_batch(brdf.get(), 1, &arrays, &flat, &whole, out.data(), &pdf));
  refused(glint_brdf_evaluate_batch(brdf.get(), 1, &arrays, &whole, &whole, nullptr, nullptr));
  refused(glint_brdf_sample_batch(brdf.get(), 1, &arrays, &flat, xi, xi, out.data(), out2.data(), &pdf));
  refused(glint_brdf_sample_batch(brdf.get(), 1, &arrays, &whole, none, xi, out.data(), out2.data(), &pdf));
  refused(glint_brdf_sample_batch(brdf.get(), 1, &arrays, &whole, xi, xi, out.data(), out2.data(), nullptr));
  EXPECT_EQ(glint_brdf_evaluate_batch(nullptr, 0, nullptr, nullptr, nullptr, nullptr, nullptr), GLINT_OK);
  EXPECT_EQ(glint_brdf_sample_batch(nullptr, 0, nullptr, nullptr, none, none, nullptr, nullptr, nullptr), GLINT_OK);
  glint_brdf_destroy(nullptr);
}

TEST(CBrdf, OptionsOutOfRangeAreRefused) {
  const Handle ndf = openHandle("ndf-cp");
  const auto refused = [&](const glint_brdf_options& options, const char* what) {
    glint_brdf* brdf = nullptr;
    EXPECT_EQ(glint_brdf_create(ndf.get(), &options, &brdf), GLINT_ERROR_USAGE) << what;
    EXPECT_NE(std::string(glint_error_message()).find(what), std::string::npos) << glint_error_message();
    EXPECT_EQ(brdf, nullptr);
  };
  for (const float bad : {-0.1f, 2e3f, kNan}) {
    glint_brdf_options o = gold();
    o.eta[1] = bad;
    refused(o, "eta");
    o = gold();
    o.k[2] = bad;
    refused(o, "k");
    o.fresnel = GLINT_FRESNEL_DIELECTRIC;
    o.eta[0] = bad;
    refused(o, "dielectric");
  }
  glint_brdf_options o = gold();
  o.fresnel = 3;
  refused(o, "fresnel");
  o = gold();
  o.facets = -1;
  refused(o, "facets");
  o = gold();
  o.struct_size -= 4;
  refused(o, "struct_size");
  glint_brdf* brdf = nullptr;
  o = gold();
  EXPECT_EQ(glint_brdf_create(nullptr, &o, &brdf), GLINT_ERROR_USAGE);
  EXPECT_EQ(glint_brdf_create(ndf.get(), &o, nullptr), GLINT_ERROR_USAGE);
}

struct DisplacedCloser {
  void operator()(glint_displaced* displaced) const { glint_displaced_close(displaced); }
};
using DisplacedHandle = std::unique_ptr<glint_displaced, DisplacedCloser>;

DisplacedHandle openDisplaced() {
  glint_displaced* displaced = nullptr;
  EXPECT_EQ(glint_displaced_open(assets().path("displacement").c_str(), 1, &displaced), GLINT_OK) << glint_error_message();
  return DisplacedHandle(displaced);
}

TEST(CDisplaced, OpensBytesInMemory) {
  const test::Bytes bytes = test::readBytes(assets().path("displacement"));
  glint_displaced* opened = nullptr;
  ASSERT_EQ(glint_displaced_open_memory(bytes.data(), bytes.size(), "shelf", 1, 1, &opened), GLINT_OK) << glint_error_message();
  const DisplacedHandle displaced(opened);
  glint_displaced_info info = {};
  info.struct_size = sizeof info;
  ASSERT_EQ(glint_displaced_get_info(displaced.get(), &info), GLINT_OK);
  EXPECT_EQ(info.file_bytes, bytes.size());
}

TEST(CDisplaced, AnswersAsTheClassDoesAlsoInBatches) {
  constexpr std::size_t kCount = 200;
  const auto sample = test::sampleDisplacement(kSize, true);
  const DisplacedBrdf same(sample.displacement);
  const DisplacedHandle displaced = openDisplaced();
  const Queries q(kCount);
  const Directions d(kCount, 6);
  std::vector<float> level;
  for (std::size_t k = 0; k < kCount; ++k) level.push_back(k % 19 == 2 ? kNan : 0.01f * static_cast<float>(k) - 0.5f);
  const glint_displaced_points points = {contiguous(level), contiguous(q.u), contiguous(q.v), {}, {}};
  const glint_directions wis = Directions::arrays(d.wi), wos = Directions::arrays(d.wo);
  for (const auto& [variant, id] : {std::pair<DisplacedVariant, int>{DisplacedVariant::full, GLINT_DISPLACED_FULL},
                                    {DisplacedVariant::lobes, GLINT_DISPLACED_LOBES},
                                    {DisplacedVariant::single, GLINT_DISPLACED_SINGLE},
                                    {DisplacedVariant::full, GLINT_DISPLACED_SINGLE + 1}}) {
    std::vector<float> reflected(3 * kCount, -1), pdfs(kCount, -1), alone(3 * kCount, -1);
    std::vector<float> drawn(3 * kCount), weights(3 * kCount), drawn_pdfs(kCount);
    ASSERT_EQ(glint_displaced_evaluate_batch(displaced.get(), id, kCount, &points, &wis, &wos, reflected.data(), pdfs.data()),
              GLINT_OK);
    ASSERT_EQ(glint_displaced_evaluate_batch(displaced.get(), id, kCount, &points, &wis, &wos, alone.data(), nullptr),
              GLINT_OK);
    ASSERT_EQ(glint_displaced_sample_batch(displaced.get(), id, kCount, &points, &wos, contiguous(q.v), contiguous(q.u),
                                           drawn.data(), weights.data(), drawn_pdfs.data()),
              GLINT_OK);
    EXPECT_EQ(reflected, alone);
    int lit = 0, weighed = 0;
    for (std::size_t k = 0; k < kCount; ++k) {
      const Vec3 wi = {d.wi[k][0], d.wi[k][1], d.wi[k][2]}, wo = {d.wo[k][0], d.wo[k][1], d.wo[k][2]};
      const LevelBlend levels = same.levelsAt(level[k]);
      const Vec2 uv = wrappedUv(double{q.u[k]}, double{q.v[k]});
      Triple one{}, direction{}, weight{};
      float pdf = -1;
      glint_displaced_evaluate(displaced.get(), id, level[k], q.u[k], q.v[k], d.wi[k].data(), d.wo[k].data(), one.data(), &pdf);
      EXPECT_EQ(one, tripleOf(same.reflected(levels, uv, wi, wo, variant))) << k;
      EXPECT_EQ(pdf, same.pdf(levels, uv, wi, wo));
      EXPECT_EQ(std::memcmp(&reflected[3 * k], one.data(), sizeof one), 0);
      EXPECT_EQ(pdfs[k], pdf);
      lit += one[0] > 0;
      glint_displaced_sample(displaced.get(), id, level[k], uv.x, uv.y, d.wo[k].data(), q.v[k], q.u[k], direction.data(),
                             weight.data(), &pdf);
      const DirectionSample s = same.sample(levels, uv, wo, {q.v[k], q.u[k]});
      EXPECT_EQ(pdf, s.pdf);
      EXPECT_EQ(direction, tripleOf(s.pdf > 0 ? s.direction : Vec3{}));
      if (pdf > 0) {
        const Rgb light = same.reflected(levels, uv, s.direction, wo, variant);
        EXPECT_FLOAT_EQ(weight[1], light.g / pdf);
        weighed += weight[1] > 0;
      }
      EXPECT_EQ(std::memcmp(&drawn[3 * k], direction.data(), sizeof direction), 0);
      EXPECT_EQ(std::memcmp(&weights[3 * k], weight.data(), sizeof weight), 0);
      EXPECT_EQ(drawn_pdfs[k], pdf);
    }
    EXPECT_GT(lit, 20);
    EXPECT_GT(weighed, 20);
  }
}

TEST(CDisplaced, SaysWhatItIsAndGivesItsSurface) {
  const auto sample = test::sampleDisplacement(kSize, true);
  const DisplacedHandle displaced = openDisplaced();
  glint_displaced_info info = {};
  info.struct_size = sizeof info;
  ASSERT_EQ(glint_displaced_get_info(displaced.get(), &info), GLINT_OK);
  EXPECT_EQ(info.width, kSize);
  EXPECT_EQ(info.height, kSize / 2);
  EXPECT_EQ(info.level_count, 2);
  EXPECT_EQ(info.channels, 3);
  EXPECT_EQ(info.base, GLINT_BASE_GGX);
  EXPECT_EQ(info.texel_size_um, 2.5f);
  EXPECT_EQ(info.factors[0], 4);
  EXPECT_EQ(info.factors[1], 8);
  EXPECT_EQ(info.factors[2], 0);
  EXPECT_GT(info.file_bytes, 0u);
  for (int l = 0; l < 2; ++l) {
    const float* heights = nullptr;
    int32_t columns = 0, rows = 0;
    ASSERT_EQ(glint_displaced_heights(displaced.get(), l, &heights, &columns, &rows), GLINT_OK);
    const DisplacementLevel& level = sample.displacement.levels[l];
    ASSERT_EQ(columns, level.columns);
    ASSERT_EQ(rows, level.rows);
    EXPECT_EQ(std::memcmp(heights, level.heights.data(), level.heights.size_bytes()), 0);
  }
  float level = -1;
  ASSERT_EQ(glint_displaced_level(displaced.get(), 4 * std::sqrt(2.0f) / std::sqrt(12.0f), &level), GLINT_OK);
  EXPECT_NEAR(level, 0.5f, 1e-6f);
  for (const auto& [sigma, expected] : {std::pair{0.0f, 0.0f}, {1e9f, 1.0f}, {kNan, 0.0f}}) {
    ASSERT_EQ(glint_displaced_level(displaced.get(), sigma, &level), GLINT_OK);
    EXPECT_EQ(level, expected);
  }
}

TEST(CDisplaced, OtherKindsAndMissingArgumentsAreRefused) {
  glint_displaced* none = nullptr;
  EXPECT_EQ(glint_displaced_open(assets().path("ndf-cp").c_str(), 0, &none), GLINT_ERROR_UNSUPPORTED);
  EXPECT_NE(std::string(glint_error_message()).find("ndf-cp"), std::string::npos);
  EXPECT_EQ(glint_displaced_open("/no/such.glint", 0, &none), GLINT_ERROR_IO);
  EXPECT_EQ(glint_displaced_open(nullptr, 0, &none), GLINT_ERROR_USAGE);
  EXPECT_EQ(glint_displaced_open("/no/such.glint", 0, nullptr), GLINT_ERROR_USAGE);
  EXPECT_EQ(none, nullptr);
  glint_ndf* ndf = nullptr;
  EXPECT_EQ(glint_ndf_open(assets().path("displacement").c_str(), nullptr, &ndf), GLINT_ERROR_UNSUPPORTED);
  EXPECT_NE(std::string(glint_error_message()).find("glint_displaced_open"), std::string::npos) << glint_error_message();

  const DisplacedHandle displaced = openDisplaced();
  const Triple w{0, 0, 1};
  Untouched refused;
  auto& [out, out2, pdf] = refused;
  refused(glint_displaced_evaluate(nullptr, 0, 0, 0, 0, w.data(), w.data(), out.data(), &pdf));
  refused(glint_displaced_evaluate(displaced.get(), 0, 0, 0, 0, nullptr, w.data(), out.data(), &pdf));
  refused(glint_displaced_evaluate(displaced.get(), 0, 0, 0, 0, w.data(), w.data(), nullptr, nullptr));
  refused(glint_displaced_sample(displaced.get(), 0, 0, 0, 0, nullptr, 0, 0, out.data(), out2.data(), &pdf));
  refused(glint_displaced_sample(displaced.get(), 0, 0, 0, 0, w.data(), 0, 0, out.data(), nullptr, &pdf));
  refused(glint_displaced_level(displaced.get(), 1, nullptr));
  const float* heights = nullptr;
  int32_t columns = -7, rows = -7;
  refused(glint_displaced_heights(displaced.get(), 2, &heights, &columns, &rows));
  refused(glint_displaced_heights(displaced.get(), -1, &heights, &columns, &rows));
  refused(glint_displaced_heights(displaced.get(), 0, nullptr, &columns, &rows));
  EXPECT_EQ(columns, -7);
  glint_displaced_info info = {};
  refused(glint_displaced_get_info(displaced.get(), &info));
  const Queries q(1);
  const Directions d(1, 1);
  const glint_displaced_points points = {contiguous(q.u), contiguous(q.u), contiguous(q.v), {}, {}};
  const glint_directions whole = Directions::arrays(d.wo);
  glint_displaced_points incomplete = points;
  incomplete.level.data = nullptr;
  const glint_floats xi = contiguous(q.u), nothing = {nullptr, 4};
  refused(glint_displaced_evaluate_batch(nullptr, 0, 1, &points, &whole, &whole, out.data(), &pdf));
  refused(glint_displaced_evaluate_batch(displaced.get(), 0, 1, &incomplete, &whole, &whole, out.data(), &pdf));
  refused(glint_displaced_evaluate_batch(displaced.get(), 0, 1, &points, nullptr, &whole, out.data(), &pdf));
  refused(glint_displaced_evaluate_batch(displaced.get(), 0, 1, &points, &whole, nullptr, out.data(), &pdf));
  refused(glint_displaced_evaluate_batch(displaced.get(), 0, 1, &points, &whole, &whole, nullptr, nullptr));
  refused(glint_displaced_sample_batch(displaced.get(), 0, 1, &points, &whole, xi, nothing, out.data(), out2.data(), &pdf));
  refused(glint_displaced_sample_batch(displaced.get(), 0, 1, &points, &whole, xi, xi, nullptr, out2.data(), &pdf));
  EXPECT_EQ(glint_displaced_evaluate_batch(nullptr, 0, 0, nullptr, nullptr, nullptr, nullptr, nullptr), GLINT_OK);
}

}  // namespace
}  // namespace glint::c_brdf_test
