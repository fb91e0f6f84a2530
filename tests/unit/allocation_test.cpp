// Counts allocations by replacing operator new for the whole program. Sanitizers replace it themselves.
#if !defined(__SANITIZE_ADDRESS__) && !defined(__SANITIZE_THREAD__)

#include <gtest/gtest.h>

#include <array>
#include <cstdlib>
#include <new>

#include "glint/bake/common/counter_random.h"
#include "glint/bake/compressed/compress.h"
#include "glint/bake/pyramid/pyramid.h"
#include "glint/query/cp_ndf.h"
#include "glint/query/manifold_ndf.h"
#include "glint/query/pyramid_ndf.h"
#include "glint/query/reference.h"
#include "support/c_api.h"
#include "support/test_maps.h"

namespace {
thread_local long allocations = 0;
}

// Not inlined: GCC would see memory of `new` in `free`, and warn of it.
void* operator new(std::size_t size) {
  ++allocations;
  if (void* memory = std::malloc(size > 0 ? size : 1)) return memory;
  throw std::bad_alloc();
}
[[gnu::noinline]] void operator delete(void* memory) noexcept { std::free(memory); }
[[gnu::noinline]] void operator delete(void* memory, std::size_t) noexcept { std::free(memory); }

namespace glint::allocation_test {
namespace {

template <class Model>
void expectNoAllocation(const Model& model) {
  const long before = allocations;
  float sum = 0;
  for (int k = 0; k < 12; ++k) {
    const Vec2 xi = bake::randomPair(1, 0, k), h = bake::randomPair(1, 1, k);
    const Footprint p = k % 2 == 0 ? Footprint::isotropic(xi, 0.5f + 0.7f * static_cast<float>(k))
                                   : Footprint::box(xi, {static_cast<float>(k), 1}, {-1, 2});
    sum += model.density(p, h) + model.mean(p, {h - Vec2{0.2f, 0.1f}, h}) + model.sample(p, xi).pdf;
  }
  EXPECT_EQ(allocations, before);
  EXPECT_GT(sum, 0);
}

TEST(Queries, AllocateNothing) {
  const long before = allocations;
  const test::OwnedMap map(32, 24, test::roughSurface(32, 24, 0.3f));
  EXPECT_GT(allocations, before);  // the counter counts
  bake::PyramidOptions options;
  options.stride = 8;
  options.resolution = 64;
  options.sigma_r = 0.02f;
  const bake::NdfPyramidData pyramid = bake::buildPyramid(map.map(), options);
  for (const Surface surface : {Surface::flat, Surface::smooth}) {
    expectNoAllocation(ManifoldNdf(map.map(), 0.02f, surface));
    for (const auto search : {Reference::Search::exhaustive, Reference::Search::pruned})
      expectNoAllocation(Reference(map.map(), 0.02f, surface, Boundary::wrap, search));
  }
  expectNoAllocation(PyramidNdf(pyramid.view()));
  expectNoAllocation(PyramidNdf(pyramid.view(), map.map()));
  for (const auto method : {CompressionMethod::cp, CompressionMethod::tucker, CompressionMethod::pca}) {
    bake::CompressionOptions o;
    o.method = method;
    const bake::NdfCpData data = bake::compressPyramid(pyramid.view(), o);
    expectNoAllocation(CpNdf(data.view()));
  }
}

TEST(CApi, QueriesAllocateNothing) {
  constexpr std::size_t kCount = 300;
  const test::Queries q(kCount);
  const glint_footprints p = test::isotropic(q);
  const float zero = 0, one = 1;
  const glint_directions up = {{&zero, 0}, {&zero, 0}, {&one, 0}};
  const glint_floats xi = test::contiguous(q.v);
  const glint_displaced_points points = {xi, xi, xi, {}, {}};
  std::array<float, 3 * kCount> colors, directions, pdfs;
  glint_displaced* displaced = nullptr;
  ASSERT_EQ(glint_displaced_open(test::assets().path("displacement").c_str(), 0, &displaced), GLINT_OK);
  for (const char* kind : test::kKinds) {
    const test::Handle ndf = test::openHandle(kind);
    glint_brdf* brdf = nullptr;
    ASSERT_EQ(glint_brdf_create(ndf.get(), nullptr, &brdf), GLINT_OK);
    const long before = allocations;
    glint_density_batch(ndf.get(), kCount, &p, xi, xi, pdfs.data());
    glint_sample_batch(ndf.get(), kCount, &p, xi, xi, colors.data(), directions.data(), pdfs.data());
    glint_brdf_evaluate_batch(brdf, kCount, &p, &up, &up, colors.data(), pdfs.data());
    glint_brdf_sample_batch(brdf, kCount, &p, &up, xi, xi, directions.data(), colors.data(), pdfs.data());
    glint_displaced_evaluate_batch(displaced, 0, kCount, &points, &up, &up, colors.data(), pdfs.data());
    glint_displaced_sample_batch(displaced, 0, kCount, &points, &up, xi, xi, directions.data(), colors.data(), pdfs.data());
    EXPECT_EQ(glint_density(nullptr, nullptr, 0, 0, nullptr), GLINT_ERROR_USAGE);
    EXPECT_EQ(allocations, before) << kind;
    glint_brdf_destroy(brdf);
  }
  glint_displaced_close(displaced);
}

}  // namespace
}  // namespace glint::allocation_test

#endif
