// Normals that pyramids keep for footprints below level 0: in the structs, in files, packed, and in sets of tiles.

#include "glint/bake/ingest/near_normals.h"

#include <gtest/gtest.h>

#include <cmath>
#include <random>
#include <string>
#include <vector>

#include "glint.h"
#include "glint/api/pack.h"
#include "glint/bake/compressed/compress.h"
#include "glint/formats/asset_writer.h"
#include "glint/query/reference.h"
#include "support/sample_assets.h"
#include "support/small_pyramid.h"
#include "support/temp_folder.h"
#include "support/test_maps.h"

namespace glint::near_normals_test {
namespace {

using bake::keepNormals;

constexpr int kWidth = 70, kHeight = 49;  // no powers of two, and odd

const test::OwnedMap& rough() {
  static const test::OwnedMap owned(kWidth, kHeight, test::roughSurface(kWidth, kHeight, 0.3f));
  return owned;
}

/// The normals of codes as a map of floats, with its own bounds.
test::OwnedMap decodedMap(const NearNormals& near) {
  std::vector<Vec2> normals;
  for (int j = 0; j < near.height; ++j)
    for (int i = 0; i < near.width; ++i) normals.push_back(near.at(i, j));
  return {near.width, near.height, std::move(normals)};
}

/// Random questions about small footprints.
class Questions {
 public:
  explicit Questions(unsigned seed) : random_(seed) {}
  Footprint footprint(float least = 0.3f, float most = 9) {
    const Vec2 uv = {unit_(random_), unit_(random_)};
    const float sigma = least * std::pow(most / least, unit_(random_));
    switch (count_++ % 3) {
      case 0:
        return Footprint::isotropic(uv, sigma);
      case 1:
        return Footprint::gaussian(uv, {sigma * sigma, 0.3f * sigma * sigma, 2 * sigma * sigma});
      default:
        return Footprint::box(uv, {sigma, 0.3f * sigma}, {-0.2f * sigma, 1.5f * sigma});
    }
  }
  /// Near a normal of the map, mostly.
  Vec2 half(const NormalMap& map) {
    const Vec2 n = map.normals[random_() % map.normals.size()];
    return n + Vec2{0.02f * (unit_(random_) - 0.5f), 0.02f * (unit_(random_) - 0.5f)};
  }
  Vec2 xi() { return {unit_(random_), unit_(random_)}; }

 private:
  std::mt19937 random_;
  std::uniform_real_distribution<float> unit_{0, 1};
  int count_ = 0;
};

template <class Asked, class Expected>
void expectSameBits(const Asked& asked, const Expected& expected, const NormalMap& map, int count = 60) {
  Questions questions(3);
  int lit = 0;
  for (int k = 0; k < count; ++k) {
    const Footprint p = questions.footprint();
    const Vec2 h = questions.half(map);
    const Box2 range = {h - Vec2{0.03f, 0.02f}, h + Vec2{0.05f, 0.01f}};
    ASSERT_EQ(asked.density(p, h), expected.density(p, h)) << k;
    ASSERT_EQ(asked.mean(p, range), expected.mean(p, range)) << k;
    const Vec2 xi = questions.xi();
    ASSERT_EQ(asked.sample(p, xi).h, expected.sample(p, xi).h) << k;
    ASSERT_EQ(asked.sample(p, xi).pdf, expected.sample(p, xi).pdf) << k;
    lit += expected.density(p, h) > 0;
  }
  EXPECT_GT(lit, count / 3);
}

TEST(NearNormals, CodesAreNearestAndInsideTheDisk) {
  std::vector<Vec2> normals = test::randomNormals(64, 64, 0.999f, 5);
  normals[3] = {0.99999994f, 0};
  normals[4] = {-0.70710677f, 0.70710677f};  // on the rim, where rounding would leave the disk
  normals[5] = {0, 0};
  const test::OwnedMap map(64, 64, normals);
  const auto kept = keepNormals(map.map(), NearType::i16);
  EXPECT_EQ(kept.view().step, 0x1p-15f);
  for (std::size_t k = 0; k < normals.size(); ++k) {
    const Vec2 n = kept.view().normal(k);
    ASSERT_LT(dot(n, n), 1.0f);
    const float most = k == 3 || k == 4 ? 1.01f : 0.5f;  // steps
    EXPECT_LE(std::fabs(n.x - normals[k].x), most * kept.view().step) << k;
    EXPECT_LE(std::fabs(n.y - normals[k].y), most * kept.view().step) << k;
  }
}

TEST(NearNormals, StepsFollowTheSteepestNormal) {
  for (const auto& [radius, step] : {std::pair{0.24f, 0x1p-17f}, {0.4f, 0x1p-16f}, {1e-3f, 0x1p-24f}, {0.0f, 0x1p-40f}}) {
    const test::OwnedMap map(16, 8, std::vector<Vec2>(16 * 8, Vec2{radius, 0}));
    const auto kept = keepNormals(map.map(), NearType::i16);
    EXPECT_EQ(kept.view().step, step) << radius;
    EXPECT_NEAR(kept.view().at(3, 2).x, radius, 0.5f * step);
  }
}

TEST(NearNormals, BytesAreThoseOfTheirTypes) {
  const auto i16 = keepNormals(rough().map(), NearType::i16), f32 = keepNormals(rough().map(), NearType::f32);
  EXPECT_EQ(2 * bake::nearBytes(i16.view()), bake::nearBytes(f32.view()));
  EXPECT_EQ(f32.view().texels, rough().map().normals.data());  // not copied
  NormalMap bare = rough().map();
  bare.bounds_level_count = 0;
  const auto built = keepNormals(bare, NearType::f32);
  ASSERT_EQ(built.view().bounds_level_count, rough().map().bounds_level_count);
  for (int l = 0; l < built.view().bounds_level_count; ++l)
    for (std::size_t k = 0; k < built.view().bounds[l].size(); ++k)
      ASSERT_EQ(built.view().node(l, k).low_x, rough().map().bounds[l].nodes[k].low_x);
}

// The fast sums read codes; brute force sees the same normals as floats.
TEST(NearNormals, CodesAnswerAsTheNormalsThatTheyMean) {
  const auto kept = keepNormals(rough().map(), NearType::i16);
  const test::OwnedMap decoded = decodedMap(kept.view());
  for (const Surface surface : {Surface::flat, Surface::smooth})
    for (const Boundary boundary : {Boundary::wrap, Boundary::clamp})
      expectSameBits(ManifoldNdf(kept.view(), 0.01f, surface, boundary), ManifoldNdf(decoded.map(), 0.01f, surface, boundary),
                     decoded.map());
}

TEST(NearNormals, AnswersHaveTheSameBitsWithAndWithoutAvx2) {
#ifdef GLINT_AVX2
  if (!hasAvx2()) GTEST_SKIP() << "needs a processor with AVX2";
  const auto kept = keepNormals(rough().map(), NearType::i16);
  Questions questions(7);
  int seen = 0;
  for (const Surface surface : {Surface::flat, Surface::smooth}) {
    const NearSurface near = {kept.view(), 0.01f, surface, Boundary::wrap, 18.5f};
    for (int k = 0; k < 60; ++k) {
      const FootprintWeights weights = weightsOf(near.grid(), questions.footprint());
      const NearPoint lobe{questions.half(rough().map())};
      const double sum = nearSumAvx2(near, weights, lobe, near.reach2);
      EXPECT_EQ(nearSumAny(near, weights, lobe, near.reach2), sum);
      seen += sum > 0;
    }
  }
  EXPECT_GT(seen, 30);
#else
  GTEST_SKIP() << "needs a compiler for AVX2";
#endif
}

/// Relative error (RMS over that of the density) of answers from kept normals, over places and half vectors near the normals, against
/// brute force on the map.
double errorOf(NearType type, float sigma_r, float sigma_texels) {
  const auto kept = keepNormals(rough().map(), type);
  const ManifoldNdf fast(kept.view(), sigma_r);
  const Reference truth(rough().map(), sigma_r, Surface::flat, Boundary::wrap, Reference::Search::pruned);
  Questions questions(11);
  double difference = 0, norm = 0;
  for (int k = 0; k < 400; ++k) {
    const Footprint p = Footprint::isotropic(questions.xi(), sigma_texels);
    const Vec2 h = questions.half(rough().map());
    const double d = truth.density(p, h);
    difference += std::pow(fast.density(p, h) - d, 2), norm += d * d;
  }
  return std::sqrt(difference / norm);
}

TEST(NearNormals, CodesErrByAThousandthBesideFloats) {
  // Codes of this map err by at most 2^-16, a three-hundredth of the lobe.
  constexpr double kCodes = 2e-3;
  for (const float sigma : {0.5f, 2.0f, 8.0f}) {
    const double codes = errorOf(NearType::i16, 0.005f, sigma), floats = errorOf(NearType::f32, 0.005f, sigma);
    std::printf("sigma_r .005, sigma %g: codes %.5f floats %.5f\n", double{sigma}, codes, floats);
    EXPECT_LT(codes, floats + kCodes) << sigma;
    EXPECT_LT(codes, 2 * kCodes) << sigma;
  }
}

struct Case {
  Case() : data(test::smallPyramid(rough().map())) {}
  bake::NdfPyramidData data;
  /// The pyramid with normals of a type.
  NdfPyramid with(const bake::NearNormalsData& kept) const {
    NdfPyramid pyramid = data.view();
    pyramid.near_normals = kept.view();
    return pyramid;
  }
};

TEST(NearNormals, PyramidsAnswerFromTheNormalsThatTheyKeep) {
  const Case c;
  const auto f32 = keepNormals(rough().map(), NearType::f32), i16 = keepNormals(rough().map(), NearType::i16);
  const PyramidNdf alone(c.data.view()), asked(c.with(f32)), given(c.data.view(), rough().map());
  EXPECT_FALSE(alone.hasNormals());
  EXPECT_TRUE(asked.hasNormals());
  EXPECT_EQ(asked.smallestSigma(), 0);
  expectSameBits(asked, given, rough().map());
  // What is given counts more than what is kept.
  const test::OwnedMap decoded = decodedMap(i16.view());
  expectSameBits(PyramidNdf(c.with(i16), rough().map()), given, rough().map(), 12);
  expectSameBits(PyramidNdf(c.with(i16)), PyramidNdf(c.data.view(), decoded.map()), decoded.map(), 24);
}

TEST(NearNormals, CompressedPyramidsAnswerFromTheNormalsThatTheyKeep) {
  const Case c;
  const auto kept = keepNormals(rough().map(), NearType::f32);
  const auto compressed = bake::compressPyramid(c.data.view(), {});
  NdfCp with = compressed.view();
  with.near_normals = kept.view();
  expectSameBits(CpNdf(with), CpNdf(compressed.view(), rough().map()), rough().map());
}

api::OpenedNdf opened(const std::filesystem::path& path) { return api::OpenedNdf::open(path, {}); }

TEST(NearNormals, FilesKeepThemWithoutAnotherFile) {
  const test::TempFolder folder;
  for (const NearType type : {NearType::f32, NearType::i16}) {
    const auto pyramid = test::samplePyramidWithNormals(32, type);
    const auto compressed = test::sampleNdfCpWithNormals(32, type);
    formats::writeAsset(folder / "p.glint", pyramid.pyramid, test::sampleProvenance(), {.overwrite = true});
    formats::writeAsset(folder / "c.glint", compressed.ndf, test::sampleProvenance(), {.overwrite = true});
    const api::OpenedNdf p = opened(folder / "p.glint"), c = opened(folder / "c.glint");
    EXPECT_TRUE(p.hasNormals());
    EXPECT_EQ(p.info().smallest_sigma_texels, 0);
    const auto normals = test::sampleNormals(32, 32);
    expectSameBits(p.model(), AnisotropicNdf<PyramidNdf>(PyramidNdf(pyramid.pyramid)), normals.map, 30);
    expectSameBits(c.model(), AnisotropicNdf<CpNdf>(CpNdf(compressed.ndf)), normals.map, 30);
    // Packed, they go along.
    const auto packed = api::pack(p);
    expectSameBits(api::viewPacked(packed).pyramidNdf(), PyramidNdf(pyramid.pyramid), normals.map, 30);
    const auto packed_cp = api::pack(c);
    EXPECT_TRUE(api::viewPacked(packed_cp).hasNormals());
    expectSameBits(api::viewPacked(packed_cp).cpNdf(), CpNdf(compressed.ndf), normals.map, 30);
  }
}

TEST(NearNormals, AreNotUsedWhereThatIsAskedFor) {
  const test::TempFolder folder;
  const auto normals = test::sampleNormals(32, 32);
  const auto pyramid = test::samplePyramidWithNormals(32, NearType::i16);
  const auto compressed = test::sampleNdfCpWithNormals(32, NearType::f32);
  NdfPyramid bare_pyramid = pyramid.pyramid;
  NdfCp bare_compressed = compressed.ndf;
  bare_pyramid.near_normals.reset();
  bare_compressed.near_normals.reset();
  formats::writeAsset(folder / "p.glint", pyramid.pyramid, test::sampleProvenance());
  formats::writeAsset(folder / "c.glint", compressed.ndf, test::sampleProvenance());
  api::NdfOptions options;
  options.use_kept_normals = false;
  const auto p = api::OpenedNdf::open(folder / "p.glint", options), c = api::OpenedNdf::open(folder / "c.glint", options);
  EXPECT_FALSE(p.hasNormals());
  EXPECT_GT(p.info().smallest_sigma_texels, 0);
  expectSameBits(p.model(), AnisotropicNdf<PyramidNdf>(PyramidNdf(bare_pyramid)), normals.map, 30);
  expectSameBits(c.model(), AnisotropicNdf<CpNdf>(CpNdf(bare_compressed)), normals.map, 30);
  EXPECT_LT(api::pack(p).size(), api::pack(opened(folder / "p.glint")).size());
}

TEST(NearNormals, AreNotUsedInCWhereThatIsAskedFor) {
  const test::TempFolder folder;
  formats::writeAsset(folder / "p.glint", test::samplePyramidWithNormals(32, NearType::i16).pyramid, test::sampleProvenance());
  const std::string path = (folder / "p.glint").string();
  for (const int kept : {int{GLINT_KEPT_NORMALS_USED}, int{GLINT_KEPT_NORMALS_IGNORED}, 2}) {
    glint_open_options options = GLINT_OPEN_OPTIONS_INIT;
    options.kept_normals = kept;
    glint_ndf* ndf = nullptr;
    const glint_status status = glint_ndf_open(path.c_str(), &options, &ndf);
    EXPECT_EQ(status, kept == 2 ? GLINT_ERROR_USAGE : GLINT_OK);
    if (ndf == nullptr) continue;
    glint_ndf_info info = {};
    info.struct_size = sizeof info;
    EXPECT_EQ(glint_ndf_get_info(ndf, &info), GLINT_OK);
    EXPECT_EQ(info.has_normals, kept == GLINT_KEPT_NORMALS_USED ? 1 : 0);
    glint_ndf_close(ndf);
  }
}

TEST(NearNormals, FilesWithoutThemHaveNone) {
  const test::TempFolder folder;
  formats::writeAsset(folder / "p.glint", test::samplePyramid(32, BlockPrecision::f16).pyramid, test::sampleProvenance());
  EXPECT_FALSE(opened(folder / "p.glint").hasNormals());
  EXPECT_GT(opened(folder / "p.glint").info().smallest_sigma_texels, 0);
}

TEST(NearNormals, NormalsOfAnotherSizeAreNotWritten) {
  const test::TempFolder folder;
  auto pyramid = test::samplePyramid(32, BlockPrecision::f16);
  const auto other = test::sampleNearNormals(64, NearType::i16);
  pyramid.pyramid.near_normals = other.near;
  EXPECT_THROW(formats::writeAsset(folder / "p.glint", pyramid.pyramid, test::sampleProvenance()), Error);
}

}  // namespace
}  // namespace glint::near_normals_test
