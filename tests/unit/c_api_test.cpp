#include "support/c_api.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <cstring>
#include <string>
#include <thread>
#include <vector>

#include "glint.h"
#include "glint/api/any_ndf.h"
#include "glint/query/manifold_ndf.h"
#include "glint/query/ray_footprint.h"
#include "support/hdf5_bytes.h"
#include "support/source_folder.h"

namespace glint::c_api_test {
namespace {

using namespace test;

/// Batches may sum in another order.
constexpr float kBatchError = 1e-6f;

void expectSame(float actual, float expected, std::size_t k) {
  EXPECT_NEAR(actual, expected, kBatchError * expected) << "query " << k;
}

TEST(CApi, AnswersAsTheModelsDo) {
  for (const char* kind : kKinds) {
    SCOPED_TRACE(kind);
    const Handle ndf = openHandle(kind);
    const auto opened = api::OpenedNdf::open(assets().path(kind));
    const Queries q(100);
    int positive = 0;
    for (std::size_t k = 0; k < q.u.size(); ++k) {
      const glint_footprint p = glint_footprint_isotropic(q.u[k], q.v[k], q.sigma[k]);
      const glint_footprint box = {GLINT_FOOTPRINT_BOX, q.u[k], q.v[k], {q.sigma[k], 1, -1, q.sigma[k]}, {0, 0}};
      const auto expected = [&](auto&& ask) { return std::visit(ask, opened.model()); };
      float density = -1, mean = -1, in_box = -1;
      ASSERT_EQ(glint_density(ndf.get(), &p, q.hx[k], q.hy[k], &density), GLINT_OK);
      ASSERT_EQ(glint_mean(ndf.get(), &p, -0.1f, q.hy[k], 0.3f, 0.5f, &mean), GLINT_OK);
      ASSERT_EQ(glint_density(ndf.get(), &box, q.hx[k], q.hy[k], &in_box), GLINT_OK);
      const Footprint footprint = Footprint::isotropic({q.u[k], q.v[k]}, q.sigma[k]);
      EXPECT_EQ(density, expected([&](const auto& m) { return m.density(footprint, {q.hx[k], q.hy[k]}); }));
      EXPECT_EQ(mean, expected([&](const auto& m) { return m.mean(footprint, {{-0.1f, q.hy[k]}, {0.3f, 0.5f}}); }));
      EXPECT_EQ(in_box, expected([&](const auto& m) {
                  return m.density(Footprint::box({q.u[k], q.v[k]}, {q.sigma[k], 1}, {-1, q.sigma[k]}), {q.hx[k], q.hy[k]});
                }));
      EXPECT_TRUE(std::isfinite(density) && density >= 0);
      positive += density > 0;
    }
    EXPECT_GT(positive, 5);
  }
}

TEST(CApi, SamplesHaveThePdfOfTheDensityAlsoInBatches) {
  // Compressed images integrate to 1 in half precision; single bins of a histogram are asked at their borders.
  constexpr float kPdfError = 2e-3f;
  constexpr std::size_t kCount = 64;
  for (const char* kind : kKinds) {
    const Handle ndf = openHandle(kind);
    ASSERT_TRUE(ndf);
    const Queries q(kCount);
    glint_footprints p = {};
    p.u = {q.u.data(), sizeof(float)}, p.v = {q.v.data(), sizeof(float)}, p.sigma = {q.sigma.data(), sizeof(float)};
    std::vector<float> x(kCount), y(kCount), pdf(kCount);
    ASSERT_EQ(glint_sample_batch(ndf.get(), kCount, &p, p.v, p.u, x.data(), y.data(), pdf.data()), GLINT_OK);
    for (std::size_t k = 0; k < kCount; ++k) {
      const glint_footprint one = glint_footprint_isotropic(q.u[k], q.v[k], q.sigma[k]);
      float hx = -9, hy = -9, single = -9, density = 0;
      ASSERT_EQ(glint_sample(ndf.get(), &one, q.v[k], q.u[k], &hx, &hy, &single), GLINT_OK);
      EXPECT_EQ(hx, x[k]) << kind << k;
      EXPECT_EQ(hy, y[k]) << kind << k;
      EXPECT_NEAR(single, pdf[k], kBatchError * single) << kind << k;
      ASSERT_EQ(glint_density(ndf.get(), &one, hx, hy, &density), GLINT_OK);
      if (single > 0 && std::fabs(hx) < 1 && std::fabs(hy) < 1) {
        EXPECT_NEAR(density / single, 1, kPdfError) << kind << k;
      }
    }
  }
  float unused = 0;
  EXPECT_EQ(glint_sample(nullptr, nullptr, 0, 0, &unused, &unused, &unused), GLINT_ERROR_USAGE);
}

TEST(CApi, BatchesEqualSingleQueries) {
  for (const char* kind : kKinds) {
    SCOPED_TRACE(kind);
    const Handle ndf = openHandle(kind);
    for (const std::size_t count : {std::size_t{1}, std::size_t{7}, std::size_t{64}, std::size_t{203}}) {
      const Queries q(count, static_cast<unsigned>(count));
      const glint_footprints p = isotropic(q);
      std::vector<float> densities(count, -1), means(count, -1);
      const float low = -0.2f;
      const std::vector<float> high(count, 0.3f);
      ASSERT_EQ(glint_density_batch(ndf.get(), count, &p, contiguous(q.hx), contiguous(q.hy), densities.data()), GLINT_OK);
      ASSERT_EQ(
          glint_mean_batch(ndf.get(), count, &p, {&low, 0}, contiguous(q.hy), contiguous(high), contiguous(high), means.data()),
          GLINT_OK);
      for (std::size_t k = 0; k < count; ++k) {
        const glint_footprint one = glint_footprint_isotropic(q.u[k], q.v[k], q.sigma[k]);
        float density = -1, mean = -1;
        glint_density(ndf.get(), &one, q.hx[k], q.hy[k], &density);
        glint_mean(ndf.get(), &one, low, q.hy[k], high[k], high[k], &mean);
        expectSame(densities[k], density, k);
        expectSame(means[k], mean, k);
      }
    }
  }
}

TEST(CApi, BatchesTakeCovariancesBoxesAndAnyStride) {
  struct Row {
    float xx, u, xy, v, yy;
  };
  const Queries q(100);
  std::vector<Row> rows;
  for (std::size_t k = 0; k < q.u.size(); ++k) rows.push_back({q.sigma[k] * q.sigma[k], q.u[k], 3, q.v[k], 900});
  const auto column = [&](const float& first) { return glint_floats{&first, sizeof(Row)}; };
  for (const char* kind : kKinds) {
    SCOPED_TRACE(kind);
    const Handle ndf = openHandle(kind);
    std::vector<float> gaussians(rows.size()), backwards(rows.size()), boxes(rows.size());
    glint_footprints p = {};
    p.u = column(rows[0].u);
    p.v = column(rows[0].v);
    p.xx = column(rows[0].xx);
    p.xy = column(rows[0].xy);
    p.yy = column(rows[0].yy);
    ASSERT_EQ(glint_density_batch(ndf.get(), rows.size(), &p, contiguous(q.hx), contiguous(q.hy), gaussians.data()), GLINT_OK);
    glint_footprints reversed = {};
    reversed.u = {&rows.back().u, -static_cast<std::ptrdiff_t>(sizeof(Row))};
    reversed.v = {&rows.back().v, -static_cast<std::ptrdiff_t>(sizeof(Row))};
    reversed.xx = {&rows.back().xx, -static_cast<std::ptrdiff_t>(sizeof(Row))};
    reversed.yy = {&rows.back().yy, -static_cast<std::ptrdiff_t>(sizeof(Row))};
    const glint_floats back_x = {&q.hx.back(), -4}, back_y = {&q.hy.back(), -4};
    ASSERT_EQ(glint_density_batch(ndf.get(), rows.size(), &reversed, back_x, back_y, backwards.data()), GLINT_OK);
    const float length = 9, none = 0;
    glint_footprints box = {};
    box.u = p.u;
    box.v = p.v;
    box.ax = box.by = {&length, 0};
    box.ay = box.bx = {&none, 0};
    ASSERT_EQ(glint_density_batch(ndf.get(), rows.size(), &box, contiguous(q.hx), contiguous(q.hy), boxes.data()), GLINT_OK);
    for (std::size_t k = 0; k < rows.size(); ++k) {
      float one = -1;
      const glint_footprint gaussian = {
          GLINT_FOOTPRINT_GAUSSIAN, rows[k].u, rows[k].v, {rows[k].xx, rows[k].xy, rows[k].yy, 0}, {0, 0}};
      glint_density(ndf.get(), &gaussian, q.hx[k], q.hy[k], &one);
      expectSame(gaussians[k], one, k);
      const glint_footprint straight = {GLINT_FOOTPRINT_GAUSSIAN, rows[k].u, rows[k].v, {rows[k].xx, 0, rows[k].yy, 0}, {0, 0}};
      glint_density(ndf.get(), &straight, q.hx[k], q.hy[k], &one);
      expectSame(backwards[rows.size() - 1 - k], one, k);
      const glint_footprint square = {GLINT_FOOTPRINT_BOX, rows[k].u, rows[k].v, {9, 0, 0, 9}, {0, 0}};
      glint_density(ndf.get(), &square, q.hx[k], q.hy[k], &one);
      expectSame(boxes[k], one, k);
    }
  }
}

TEST(CApi, NullAndMissingArgumentsAreErrorsThatTouchNothing) {
  const Handle ndf = openHandle("ndf-cp");
  const Queries q(3);
  const glint_footprints complete = isotropic(q);
  const glint_floats h = contiguous(q.hx), none = {nullptr, 4};
  std::vector<float> out(3, -7);
  const auto refused = [&](glint_status status) {
    EXPECT_EQ(status, GLINT_ERROR_USAGE);
    EXPECT_STRNE(glint_error_message(), "");
    EXPECT_STREQ(glint_error_rule(), "api.arguments");
    EXPECT_EQ(out, std::vector<float>(3, -7));
  };
  refused(glint_density_batch(nullptr, 3, &complete, h, h, out.data()));
  refused(glint_density_batch(ndf.get(), 3, nullptr, h, h, out.data()));
  refused(glint_density_batch(ndf.get(), 3, &complete, h, h, nullptr));
  refused(glint_density_batch(ndf.get(), 3, &complete, none, h, out.data()));
  refused(glint_density_batch(ndf.get(), 3, &complete, h, none, out.data()));
  refused(glint_mean_batch(ndf.get(), 3, &complete, h, h, h, none, out.data()));
  for (auto member : {&glint_footprints::u, &glint_footprints::v, &glint_footprints::sigma}) {
    glint_footprints p = complete;
    p.*member = none;
    refused(glint_density_batch(ndf.get(), 3, &p, h, h, out.data()));
  }
  glint_footprints half = complete;  // a covariance without yy is none
  half.sigma = none;
  half.xx = h;
  refused(glint_density_batch(ndf.get(), 3, &half, h, h, out.data()));
  EXPECT_EQ(glint_density_batch(nullptr, 0, nullptr, none, none, nullptr), GLINT_OK);
  EXPECT_EQ(glint_mean_batch(nullptr, 0, nullptr, none, none, none, none, nullptr), GLINT_OK);
  refused(glint_ndf_get_info(ndf.get(), nullptr));
  glint_ndf_info info = {};
  refused(glint_ndf_get_info(ndf.get(), &info));
}

TEST(CApi, InfoSaysWhatTheHandleIs) {
  for (const char* kind : {"normals", "ndf-pyramid", "ndf-cp"}) {
    const Handle ndf = openHandle(kind);
    glint_ndf_info info = {};
    info.struct_size = sizeof info;
    ASSERT_EQ(glint_ndf_get_info(ndf.get(), &info), GLINT_OK);
    EXPECT_STREQ(info.kind, kind);
    EXPECT_EQ(info.width, kSize);
    EXPECT_EQ(info.height, kSize);
    const bool normals = std::string(kind) == "normals";
    EXPECT_EQ(info.resolution, normals ? 256 : 64);
    EXPECT_EQ(info.level_count, normals ? 0 : 2);  // besides the mean
    EXPECT_FLOAT_EQ(info.sigma_r, normals ? 0.005f : 0.05f);
    EXPECT_FLOAT_EQ(info.finest_sigma_texels, normals ? 0 : kFootprintPerStride * kSize / 4);
    EXPECT_FLOAT_EQ(info.coarsest_sigma_texels, normals ? 0 : kFootprintPerStride * kSize / 2);
    EXPECT_EQ(info.has_normals, 0);
    EXPECT_GT(info.file_bytes, 0u);
  }
}

TEST(CApi, StructsOfAnOlderOrNewerHeaderAreUnderstood) {
  const Handle ndf = openHandle("ndf-cp");
  struct {
    glint_ndf_info info;
    char beyond[16];
  } grown = {};
  grown.info.struct_size = sizeof grown;
  std::memset(grown.beyond, 0x5a, sizeof grown.beyond);
  ASSERT_EQ(glint_ndf_get_info(ndf.get(), &grown.info), GLINT_OK);
  EXPECT_EQ(grown.info.width, kSize);
  EXPECT_EQ(grown.beyond[0], 0x5a);
  glint_ndf_info small = {};
  small.struct_size = offsetof(glint_ndf_info, height);
  small.height = -3;
  ASSERT_EQ(glint_ndf_get_info(ndf.get(), &small), GLINT_OK);
  EXPECT_EQ(small.width, kSize);
  EXPECT_EQ(small.height, -3);

  struct {
    glint_open_options options = GLINT_OPEN_OPTIONS_INIT;
    char beyond[16] = {};
  } newer;
  newer.options.struct_size = sizeof newer;
  EXPECT_TRUE(openHandle("ndf-cp", &newer.options));
  newer.beyond[3] = 1;
  glint_ndf* refused = nullptr;
  EXPECT_EQ(glint_ndf_open(assets().path("ndf-cp").c_str(), &newer.options, &refused), GLINT_ERROR_USAGE);
  EXPECT_EQ(refused, nullptr);
}

TEST(CApi, StructSizesThatNoStructHasAreRefused) {
  const Handle ndf = openHandle("ndf-cp");
  for (const std::size_t size : {std::size_t{GLINT_MOST_STRUCT_SIZE} + 1, SIZE_MAX}) {
    glint_open_options options = GLINT_OPEN_OPTIONS_INIT;
    options.struct_size = size;
    glint_ndf* refused = nullptr;
    EXPECT_EQ(glint_ndf_open(assets().path("ndf-cp").c_str(), &options, &refused), GLINT_ERROR_USAGE);
    EXPECT_EQ(refused, nullptr);
    EXPECT_NE(std::string(glint_error_message()).find("struct_size"), std::string::npos);
    glint_ndf_info info = {};
    info.struct_size = size;
    EXPECT_EQ(glint_ndf_get_info(ndf.get(), &info), GLINT_ERROR_USAGE);
    EXPECT_EQ(info.width, 0);
  }
}

TEST(CApi, ErrorsNameTheArgumentThatIsNull) {
  const Handle ndf = openHandle("ndf-cp");
  const glint_footprint p = glint_footprint_isotropic(0.1f, 0.9f, 5);
  float a = 0, b = 0;
  const auto message = [](glint_status status) {
    EXPECT_EQ(status, GLINT_ERROR_USAGE);
    return std::string(glint_error_message());
  };
  EXPECT_EQ(message(glint_density(nullptr, &p, 0, 0, &a)), "glint_density: ndf is null");
  EXPECT_EQ(message(glint_density(ndf.get(), nullptr, 0, 0, &a)), "glint_density: footprint is null");
  EXPECT_EQ(message(glint_density(ndf.get(), &p, 0, 0, nullptr)), "glint_density: density is null");
  EXPECT_EQ(message(glint_mean(ndf.get(), &p, 0, 0, 1, 1, nullptr)), "glint_mean: mean is null");
  EXPECT_EQ(message(glint_sample(ndf.get(), &p, 0, 0, &a, nullptr, &b)), "glint_sample: hy is null");
  EXPECT_EQ(message(glint_brdf_evaluate(nullptr, &p, nullptr, nullptr, nullptr, nullptr)), "glint_brdf_evaluate: brdf is null");
  EXPECT_EQ(message(glint_displaced_level(nullptr, 1, &a)), "glint_displaced_level: displaced is null");
}

/// Answers of a handle that tell assets apart.
float densityOf(const glint_ndf* ndf) {
  const glint_footprint p = glint_footprint_isotropic(0.1f, 0.9f, 20);
  float density = 0;
  EXPECT_EQ(glint_density(ndf, &p, 0.05f, 0.1f, &density), GLINT_OK);
  return density;
}

/// Bytes that a function reads; fails where there are none.
int32_t readFrom(void* context, uint64_t offset, void* to, size_t size) {
  const auto& bytes = *static_cast<const test::Bytes*>(context);
  if (bytes.empty()) return 1;
  std::memcpy(to, bytes.data() + offset, size);
  return 0;
}

TEST(CApi, BytesInMemoryAnswerAsTheFile) {
  const Handle file = openHandle("ndf-cp");
  for (const int32_t copy : {0, 1}) {
    test::Bytes bytes = test::readBytes(assets().path("ndf-cp"));
    glint_open_options options = GLINT_OPEN_OPTIONS_INIT;
    options.copy = copy;
    glint_ndf* opened = nullptr;
    ASSERT_EQ(glint_ndf_open_memory(bytes.data(), bytes.size(), "shelf", &options, &opened), GLINT_OK) << glint_error_message();
    const Handle memory(opened);
    if (copy != 0) std::fill(bytes.begin(), bytes.end(), std::byte{0});
    EXPECT_EQ(densityOf(memory.get()), densityOf(file.get()));
  }
}

TEST(CApi, BytesThatAFunctionReadsAnswerAsTheFile) {
  test::Bytes bytes = test::readBytes(assets().path("ndf-cp"));
  const glint_source source = {nullptr, bytes.size(), &bytes, &readFrom};
  glint_ndf* opened = nullptr;
  ASSERT_EQ(glint_ndf_open_source(&source, nullptr, &opened), GLINT_OK) << glint_error_message();
  const Handle read(opened);
  EXPECT_EQ(densityOf(read.get()), densityOf(openHandle("ndf-cp").get()));
}

TEST(CApi, BytesThatCannotBeUsedAreRefusedByName) {
  test::Bytes none;
  const glint_source empty = {"archive", 100, &none, &readFrom}, unread = {"archive", 100, &none, nullptr};
  const char text[] = "no asset";
  glint_ndf* ndf = nullptr;
  EXPECT_EQ(glint_ndf_open_memory(text, sizeof text, "shelf", nullptr, &ndf), GLINT_ERROR_INVALID_INPUT);
  EXPECT_STREQ(glint_error_rule(), "file.signature");
  EXPECT_EQ(std::string(glint_error_message()).find("shelf: "), 0u);
  EXPECT_EQ(glint_ndf_open_memory(text, sizeof text, nullptr, nullptr, &ndf), GLINT_ERROR_INVALID_INPUT);
  EXPECT_EQ(std::string(glint_error_message()).find("memory: "), 0u);
  EXPECT_EQ(glint_ndf_open_memory(nullptr, 8, nullptr, nullptr, &ndf), GLINT_ERROR_USAGE);
  EXPECT_EQ(glint_ndf_open_memory(text, sizeof text, nullptr, nullptr, nullptr), GLINT_ERROR_USAGE);
  EXPECT_EQ(glint_ndf_open_source(&empty, nullptr, &ndf), GLINT_ERROR_IO);
  EXPECT_EQ(std::string(glint_error_message()).find("archive: "), 0u);
  EXPECT_EQ(glint_ndf_open_source(&unread, nullptr, &ndf), GLINT_ERROR_USAGE);
  EXPECT_EQ(glint_ndf_open_source(nullptr, nullptr, &ndf), GLINT_ERROR_USAGE);
  EXPECT_EQ(ndf, nullptr);
  glint_displaced* displaced = nullptr;
  EXPECT_EQ(glint_displaced_open_memory(text, sizeof text, nullptr, 0, 0, &displaced), GLINT_ERROR_INVALID_INPUT);
  EXPECT_EQ(glint_displaced_open_memory(nullptr, 8, nullptr, 0, 0, &displaced), GLINT_ERROR_USAGE);
  EXPECT_EQ(glint_displaced_open_source(&empty, 0, &displaced), GLINT_ERROR_IO);
  EXPECT_EQ(glint_displaced_open_source(nullptr, 0, &displaced), GLINT_ERROR_USAGE);
  EXPECT_EQ(displaced, nullptr);
}

TEST(CApi, PixelsAreSmoothOrConstant) {
  const glint_footprint p = glint_footprint_isotropic(0.1f, 0.9f, 20);
  for (const char* kind : {"ndf-pyramid", "ndf-cp"}) {
    glint_open_options options = GLINT_OPEN_OPTIONS_INIT;
    const Handle smooth = openHandle(kind, &options);
    options.pixels = GLINT_PIXELS_CONSTANT;
    const Handle constant = openHandle(kind, &options);
    glint_ndf_info info = {};
    info.struct_size = sizeof info;
    ASSERT_EQ(glint_ndf_get_info(constant.get(), &info), GLINT_OK);
    const float pixel = 2.0f / static_cast<float>(info.resolution);
    float low[2], high[2];  // towards both ends of a pixel, of smooth and of constant pixels
    for (const auto& [ndf, k] : {std::pair{smooth.get(), 0}, {constant.get(), 1}}) {
      ASSERT_EQ(glint_density(ndf, &p, 0.1f * pixel, 0.5f * pixel, &low[k]), GLINT_OK);
      ASSERT_EQ(glint_density(ndf, &p, 0.9f * pixel, 0.5f * pixel, &high[k]), GLINT_OK);
    }
    EXPECT_NE(low[0], high[0]) << kind;
    EXPECT_EQ(low[1], high[1]) << kind;
    EXPECT_GT(low[1], 0) << kind;
    options.pixels = 2;
    glint_ndf* refused = nullptr;
    EXPECT_EQ(glint_ndf_open(assets().path(kind).c_str(), &options, &refused), GLINT_ERROR_USAGE);
    EXPECT_STREQ(glint_error_message(), "glint_open_options: unknown pixels");
  }
}

TEST(CApi, OptionsReachTheModel) {
  glint_open_options options = GLINT_OPEN_OPTIONS_INIT;
  options.sigma_r = 0.1f;
  options.surface = GLINT_SURFACE_SMOOTH;
  options.boundary = GLINT_BOUNDARY_CLAMP;
  options.verify_hashes = 1;
  const Handle rough = openHandle("normals", &options);
  const glint_footprint p = glint_footprint_isotropic(0.1f, 0.9f, 5);
  float density = -1;
  glint_density(rough.get(), &p, 0.05f, 0.1f, &density);
  const auto map = test::sampleNormals(kSize, kSize);
  const Reference same(map.map, 0.1f, Surface::smooth, Boundary::clamp, Reference::Search::pruned);
  EXPECT_EQ(density, same.density(Footprint::isotropic({0.1f, 0.9f}, 5), {0.05f, 0.1f}));

  const std::string normals = assets().path("normals");
  glint_open_options below = GLINT_OPEN_OPTIONS_INIT;
  below.normals_path = normals.c_str();
  const Handle with_normals = openHandle("ndf-cp", &below);
  const glint_footprint narrow = glint_footprint_isotropic(0.1f, 0.9f, 2);
  glint_density(with_normals.get(), &narrow, 0.05f, 0.1f, &density);
  EXPECT_EQ(density, ManifoldNdf(map.map, 0.05f).density(Footprint::isotropic({0.1f, 0.9f}, 2), {0.05f, 0.1f}));
  glint_ndf_info info = {};
  info.struct_size = sizeof info;
  glint_ndf_get_info(with_normals.get(), &info);
  EXPECT_EQ(info.has_normals, 1);
}

TEST(CApi, EstimatorsOfBinMapsReachTheModel) {
  const auto opened = api::OpenedNdf::open(assets().path("bin-map"));
  const auto& map = opened.asset().get<BinMap>();
  const glint_footprint p = glint_footprint_isotropic(0.4f, 0.6f, 6);
  glint_open_options options = GLINT_OPEN_OPTIONS_INIT;
  float exact = -1, published = -1;
  glint_density(openHandle("bin-map", &options).get(), &p, 0.05f, 0.02f, &exact);
  options.estimator = GLINT_ESTIMATOR_PUBLISHED;
  glint_density(openHandle("bin-map", &options).get(), &p, 0.05f, 0.02f, &published);
  const BinMapNdf same(map, map.alpha_min, BinEstimator::published);
  EXPECT_EQ(published, same.density(Footprint::isotropic({0.4f, 0.6f}, 6), {0.05f, 0.02f}));
  EXPECT_NE(published, exact);
}

TEST(CApi, OptionsOfHistogramsReachTheModel) {
  const Footprint slanted = Footprint::box({0.4f, 0.6f}, {14, 5}, {-5, 14}), round = Footprint::isotropic({0.4f, 0.6f}, 9);
  const glint_footprint c_slanted = {GLINT_FOOTPRINT_BOX, 0.4f, 0.6f, {14, 5, -5, 14}, {0, 0}};
  const glint_footprint c_round = glint_footprint_isotropic(0.4f, 0.6f, 9);
  const auto histograms = test::sampleHistograms(kSize, kSize);
  std::vector<float> slanted_answers, round_answers;
  for (const auto& [tolerance, boxes] : {std::pair{0.0f, 0}, {0.5f, 1}, {GLINT_SLANT_EXACT, 1}, {0.06f, 3}}) {
    glint_open_options options = GLINT_OPEN_OPTIONS_INIT;
    options.slant_tolerance = tolerance;
    options.gaussian_boxes = boxes;
    const Handle ndf = openHandle("histogram-sat", &options);
    const HistogramNdf same(histograms.sat, boxes == 3 ? GaussianBoxes::three : GaussianBoxes::one,
                            tolerance == 0 ? kSlantTolerance : std::max(0.0f, tolerance));
    float density = -1;
    glint_mean(ndf.get(), &c_slanted, -0.3f, -0.2f, 0.1f, 0.2f, &density);
    EXPECT_EQ(density, same.mean(slanted, {{-0.3f, -0.2f}, {0.1f, 0.2f}}));
    slanted_answers.push_back(density);
    glint_mean(ndf.get(), &c_round, -0.3f, -0.2f, 0.1f, 0.2f, &density);
    EXPECT_EQ(density, same.mean(round, {{-0.3f, -0.2f}, {0.1f, 0.2f}}));
    round_answers.push_back(density);
  }
  for (const auto& [bins, shape] :
       {std::pair{GLINT_BINS_EVEN, HistogramBins::even}, {GLINT_BINS_LOBES, HistogramBins::lobes}}) {
    glint_open_options options = GLINT_OPEN_OPTIONS_INIT;
    options.bins = bins;
    options.sigma_r = 0.02f;
    const Handle ndf = openHandle("histogram-sat", &options);
    const HistogramNdf same(histograms.sat, GaussianBoxes::one, kSlantTolerance, shape, 0.02f);
    float density = -1;
    glint_density(ndf.get(), &c_round, 0.1f, 0.05f, &density);
    EXPECT_EQ(density, same.density(round, {0.1f, 0.05f}));
    round_answers.push_back(density);
  }
  EXPECT_NE(round_answers[4], round_answers[5]);
  EXPECT_NE(slanted_answers[1], slanted_answers[2]);  // or the options would not be seen
  EXPECT_NE(round_answers[0], round_answers[3]);
}

TEST(CApi, StretchedFootprintsAreAskedAsSeveralRoundOnes) {
  const formats::Asset asset = formats::Asset::open(assets().path("ndf-pyramid"));
  const PyramidNdf round(asset.get<NdfPyramid>());
  const AnisotropicNdf<PyramidNdf> stretched(round);
  glint_open_options options = GLINT_OPEN_OPTIONS_INIT;
  options.footprint_parts = 1;
  const Handle several = openHandle("ndf-pyramid"), one = openHandle("ndf-pyramid", &options);
  double difference = 0, sum = 0;
  const Queries q(50);
  for (std::size_t k = 0; k < q.u.size(); ++k) {
    const Footprint p = Footprint::gaussian({q.u[k], q.v[k]}, {400, 30, 9});
    const glint_footprint given = {GLINT_FOOTPRINT_GAUSSIAN, q.u[k], q.v[k], {400, 30, 9, 0}, {0, 0}};
    float answer = -1, batch = -1;
    glint_density(several.get(), &given, q.hx[k], q.hy[k], &answer);
    EXPECT_EQ(answer, stretched.density(p, {q.hx[k], q.hy[k]}));
    glint_footprints arrays = {};
    arrays.precise_u = {&given.u, 0}, arrays.precise_v = {&given.v, 0};
    arrays.xx = {&given.m[0], 0}, arrays.xy = {&given.m[1], 0}, arrays.yy = {&given.m[2], 0};
    glint_density_batch(several.get(), 1, &arrays, {&q.hx[k], 0}, {&q.hy[k], 0}, &batch);
    EXPECT_EQ(batch, answer);
    glint_density(one.get(), &given, q.hx[k], q.hy[k], &batch);
    EXPECT_EQ(batch, round.density(p, {q.hx[k], q.hy[k]}));
    difference += std::fabs(answer - batch), sum += answer;
  }
  EXPECT_GT(difference, 0.015 * sum);  // or the option would not be seen
}

TEST(CApi, FootprintsFromRayDifferentials) {
  const Footprint p = footprintFromDifferentials({0.1f, 0.2f}, {0.01f, 0.002f}, {-0.003f, 0.02f}, 512, 256);
  const glint_footprint c = glint_footprint_from_differentials(0.1f, 0.2f, 0.01f, 0.002f, -0.003f, 0.02f, 512, 256);
  EXPECT_EQ(c.kind, GLINT_FOOTPRINT_GAUSSIAN);
  EXPECT_EQ(c.u, 0.1f);
  EXPECT_EQ(c.v, 0.2f);
  EXPECT_EQ(c.m[0], p.covariance.xx);
  EXPECT_EQ(c.m[1], p.covariance.xy);
  EXPECT_EQ(c.m[2], p.covariance.yy);
  // Large ones stay large, though their squares are not finite.
  EXPECT_GT(glint_footprint_isotropic(0, 0, 1e30f).m[0], 1e29f);
}

TEST(CApi, OptionsOutOfRangeAreRefusedByName) {
  const auto refused = [](auto glint_open_options::*member, auto value, const char* name) {
    glint_open_options options = GLINT_OPEN_OPTIONS_INIT;
    options.*member = value;
    glint_ndf* ndf = nullptr;
    EXPECT_EQ(glint_ndf_open(assets().path("histogram-sat").c_str(), &options, &ndf), GLINT_ERROR_USAGE) << value;
    EXPECT_NE(std::string(glint_error_message()).find(name), std::string::npos) << glint_error_message();
    EXPECT_EQ(ndf, nullptr);
  };
  for (const float value : {-0.5f, 1.01f, kNan}) refused(&glint_open_options::slant_tolerance, value, "slant_tolerance");
  for (const int32_t value : {-1, 2, 4}) refused(&glint_open_options::gaussian_boxes, value, "gaussian_boxes");
  for (const float value : {-0.1f, 0.3f, kNan}) refused(&glint_open_options::sigma_r, value, "sigma_r");
  refused(&glint_open_options::surface, 2, "surface");
  refused(&glint_open_options::boundary, -1, "boundary");
  for (const int32_t value : {-1, 2}) refused(&glint_open_options::estimator, value, "estimator");
  for (const int32_t value : {-1, 33}) refused(&glint_open_options::footprint_parts, value, "footprint_parts");
}

TEST(CApi, OptionsOfAnOlderHeaderHaveTheDefaultsOfLaterOnes) {
  glint_open_options older = GLINT_OPEN_OPTIONS_INIT;
  older.struct_size = offsetof(glint_open_options, slant_tolerance);
  older.slant_tolerance = -7;  // not the caller's memory: would be refused
  older.gaussian_boxes = -7;
  EXPECT_TRUE(openHandle("histogram-sat", &older));
}

TEST(CApi, FailedOpeningSaysWhy) {
  glint_ndf* ndf = nullptr;
  EXPECT_EQ(glint_ndf_open("/no/such.glint", nullptr, &ndf), GLINT_ERROR_IO);
  EXPECT_NE(std::string(glint_error_message()).find("/no/such.glint"), std::string::npos);
  EXPECT_EQ(glint_ndf_open(assets().path("heights").c_str(), nullptr, &ndf), GLINT_ERROR_UNSUPPORTED);
  EXPECT_STREQ(glint_error_rule(), "format.kind");
  EXPECT_EQ(glint_ndf_open((test::sourceFolder() / "README.md").c_str(), nullptr, &ndf), GLINT_ERROR_INVALID_INPUT);
  const std::string endless(100000, 'x');  // the message is cut, not lost
  EXPECT_EQ(glint_ndf_open(endless.c_str(), nullptr, &ndf), GLINT_ERROR_IO);
  EXPECT_GT(std::strlen(glint_error_message()), 300u);
  EXPECT_EQ(ndf, nullptr);
  std::string elsewhere = "unset";
  std::thread([&] { elsewhere = glint_error_message(); }).join();
  EXPECT_EQ(elsewhere, "");
}

TEST(CApi, EightThreadsGetTheAnswersOfOne) {
  constexpr int kThreads = 8;
  constexpr std::size_t kCount = 50;  // sums over texels are slow in the sanitizers
  for (const char* kind : kKinds) {
    SCOPED_TRACE(kind);
    const Handle ndf = openHandle(kind);
    const Queries q(kCount);
    const glint_footprints p = isotropic(q);
    const auto answers = [&] {
      std::vector<float> out(5 * kCount);
      glint_sample_batch(ndf.get(), kCount, &p, p.v, p.u, &out[2 * kCount], &out[3 * kCount], &out[4 * kCount]);
      glint_density_batch(ndf.get(), kCount, &p, contiguous(q.hx), contiguous(q.hy), out.data());
      for (std::size_t k = 0; k < kCount; ++k) {
        const glint_footprint one = glint_footprint_isotropic(q.u[k], q.v[k], q.sigma[k]);
        glint_mean(ndf.get(), &one, -0.1f, -0.1f, 0.2f, 0.3f, &out[kCount + k]);
      }
      return out;
    };
    const std::vector<float> alone = answers();
    std::vector<std::vector<float>> together(kThreads);
    std::vector<std::thread> threads;
    for (auto& out : together) threads.emplace_back([&] { out = answers(); });
    for (std::thread& thread : threads) thread.join();
    for (const auto& out : together) EXPECT_EQ(out, alone);
  }
}

}  // namespace
}  // namespace glint::c_api_test
