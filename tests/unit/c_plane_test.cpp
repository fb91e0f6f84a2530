#include <cmath>

#include "glint/query/tiny_example_ndf.h"
#include "support/c_api.h"

namespace glint::c_plane_test {
namespace {

/// A plane of scattered examples, in a file and in memory.
struct Plane {
  test::TempFolder folder;
  test::SampleTinyExample sample = test::sampleTinyExample(16, TinyMode::scattered);
  glint_ndf* ndf = nullptr;

  Plane() {
    const std::string path = (folder.path() / "plane.glint").string();
    formats::writeAsset(path, sample.example, test::sampleProvenance());
    EXPECT_EQ(glint_ndf_open(path.c_str(), nullptr, &ndf), GLINT_OK);
  }
  ~Plane() { glint_ndf_close(ndf); }
};

TEST(CPlane, AnswersAtAnyCell) {
  const Plane plane;
  const TinyExampleNdf model(plane.sample.example);
  const double far = std::ldexp(1.0, 36);
  float before = -1;
  for (const double u : {0.25, 1.25, -3.75, far + 0.25}) {
    const glint_footprint p = glint_footprint_isotropic(u, 0.5 - far, 3);
    float density = 0, mean = 0, hx = 0, hy = 0, pdf = 0;
    ASSERT_EQ(glint_density(plane.ndf, &p, 0.1f, 0.05f, &density), GLINT_OK);
    ASSERT_EQ(glint_mean(plane.ndf, &p, -1, -1, 0.25f, 1, &mean), GLINT_OK);
    ASSERT_EQ(glint_sample(plane.ndf, &p, 0.3f, 0.7f, &hx, &hy, &pdf), GLINT_OK);
    const auto cell = static_cast<std::int64_t>(std::floor(u)), row = -(std::int64_t{1} << 36);
    const TinyExampleNdf there = model.movedTo(cell, row);
    const Footprint same = Footprint::isotropic({static_cast<float>(u - std::floor(u)), 0.5f}, 3);
    EXPECT_EQ(density, there.density(same, {0.1f, 0.05f}));
    EXPECT_EQ(mean, there.mean(same, {{-1, -1}, {0.25f, 1}}));
    float rgb[3] = {}, spectrum = 0;
    ASSERT_EQ(glint_density_rgb(plane.ndf, &p, 0.1f, 0.05f, rgb), GLINT_OK);
    ASSERT_EQ(glint_density_spectrum(plane.ndf, &p, 0.1f, 0.05f, &spectrum, 1), GLINT_OK);
    EXPECT_EQ(rgb[1], density);
    EXPECT_EQ(spectrum, density);
    EXPECT_EQ(pdf, there.sample(same, {0.3f, 0.7f}).pdf);
    EXPECT_NE(mean, before);  // cells are not alike
    before = mean;
  }
}

TEST(CPlane, BatchesAnswerAsSingleQueriesDo) {
  const Plane plane;
  const double u[3] = {0.5, 1234567.5, -68719476735.25}, v[3] = {7.25, -3, 0.125};
  const float float_u[3] = {0.5f, 5000.5f, -77.25f}, float_v[3] = {7.25f, -3, 0.125f}, sigma = 2, x = 0.05f, y = -0.1f;
  glint_footprints precise = {}, plain = {};
  precise.precise_u = {u, sizeof(double)}, precise.precise_v = {v, sizeof(double)}, precise.sigma = {&sigma, 0};
  plain.u = {float_u, sizeof(float)}, plain.v = {float_v, sizeof(float)}, plain.sigma = {&sigma, 0};
  float of_precise[3] = {}, of_plain[3] = {};
  ASSERT_EQ(glint_density_batch(plane.ndf, 3, &precise, {&x, 0}, {&y, 0}, of_precise), GLINT_OK);
  ASSERT_EQ(glint_density_batch(plane.ndf, 3, &plain, {&x, 0}, {&y, 0}, of_plain), GLINT_OK);
  float colours[9] = {};
  ASSERT_EQ(glint_density_rgb_batch(plane.ndf, 3, &precise, {&x, 0}, {&y, 0}, colours), GLINT_OK);
  for (int k = 0; k < 3; ++k) {
    float density = 0;
    glint_footprint p = glint_footprint_isotropic(u[k], v[k], sigma);
    ASSERT_EQ(glint_density(plane.ndf, &p, x, y, &density), GLINT_OK);
    EXPECT_EQ(of_precise[k], density);
    EXPECT_EQ(colours[3 * k], density);
    p = glint_footprint_isotropic(double{float_u[k]}, double{float_v[k]}, sigma);
    ASSERT_EQ(glint_density(plane.ndf, &p, x, y, &density), GLINT_OK);
    EXPECT_EQ(of_plain[k], density);
  }
}

}  // namespace
}  // namespace glint::c_plane_test
