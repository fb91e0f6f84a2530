// Vectors of eight against those of four, to the bit: factors of compressed pyramids and pixels of blocks.
#include <gtest/gtest.h>

#include <cmath>
#include <random>
#include <string>
#include <vector>

#include "glint/bake/compressed/compress.h"
#include "glint/math/half.h"
#include "glint/query/cp_ndf.h"
#include "glint/query/detail/compressed/avx2_reader.h"
#include "glint/query/detail/pyramid/avx2_blocks.h"
#include "glint/query/detail/pyramid/block_cover.h"
#include "glint/query/detail/pyramid/block_rows.h"
#include "glint/query/pyramid_ndf.h"
#include "support/small_pyramid.h"
#include "support/test_maps.h"

#ifdef GLINT_AVX2

namespace glint::avx2_test {
namespace {

struct Compared {
  int columns = 0, narrow = 0;  ///< most that a cluster has
  bool odd = false;             ///< whether a cluster's halves differ by one column
  int slices = 0, alone = 0;
};

void expectEqual(const float* avx2, const float* expected, int count, const char* what) {
  for (int k = 0; k < count; ++k) ASSERT_EQ(avx2[k], expected[k]) << what << " " << k << " of " << count;
}

/// Columns of a projection, in groups of four with zeros up to their ends.
template <class Reader>
std::vector<float> projectionOf(const Reader& reader, const NdfCluster& cluster, int x, int y) {
  const ColumnLayout layout(cluster);
  std::vector<float> projection(ColumnLayout::kMost, 7);
  reader.pixel(cluster, layout, x, y, projection.data());
  projection.resize(static_cast<std::size_t>(layout.half > 0 ? layout.high() + (layout.half + 3) / 4 * 4 : layout.low()));
  return projection;
}

template <class Reader>
void expectReadersAgree(const NdfCp& ndf, const Reader& reader, Compared& compared) {
  const typename Reader::Avx2 avx2(reader);
  std::mt19937 random(1);
  for (const NdfCluster& cluster : ndf.clusters) {
    if (cluster.columns == 0 || cluster.slice_count == 0) continue;
    compared.columns = std::max(compared.columns, int{cluster.columns});
    compared.narrow = std::max(compared.narrow, int{cluster.narrow_columns});
    compared.odd = compared.odd || cluster.narrow_columns % 2 != 0;
    const ColumnLayout layout(cluster);
    for (int round = 0; round < 6; ++round) {
      const int x = round == 0 ? 0 : static_cast<int>(random() % 16), y = round == 1 ? 0 : static_cast<int>(random() % 16);
      const auto projection = projectionOf(reader, cluster, x, y), by_eight = projectionOf(avx2, cluster, x, y);
      expectEqual(by_eight.data(), projection.data(), static_cast<int>(projection.size()), "projection");
      typename Reader::Row rows[4];
      for (auto& row : rows) row = reader.row(cluster, random() % cluster.slice_count);
      float dots[4], avx2_dots[4];
      reader.dots(projection.data(), layout, rows).store(dots);
      avx2.dots(projection.data(), layout, rows).store(avx2_dots);
      expectEqual(avx2_dots, dots, 4, "dot product");
      if (reader.asksAlone(cluster)) {
        ++compared.alone;
        ASSERT_EQ(avx2.valueAlone(cluster, rows[0], x, y), reader.valueAlone(cluster, rows[0], x, y));
      }
      float scaled[kMaxColumns], avx2_scaled[kMaxColumns], sums[kBlockSize], avx2_sums[kBlockSize];
      float weights[kBlockPixels], avx2_weights[kBlockPixels];
      reader.scaledCoefficients(cluster, rows[1], scaled);
      avx2.scaledCoefficients(cluster, rows[1], avx2_scaled);
      expectEqual(avx2_scaled, scaled, cluster.columns, "coefficient");
      reader.sliceWeights(cluster, rows[1], weights);
      avx2.sliceWeights(cluster, rows[1], avx2_weights);
      reader.leastSums(cluster, weights).store(sums);
      avx2.leastSums(cluster, avx2_weights).store(avx2_sums);
      expectEqual(avx2_sums, sums, kBlockSize, "sum of row");
      reader.rowPixels(cluster, weights, y).store(sums);
      avx2.rowPixels(cluster, avx2_weights, y).store(avx2_sums);
      expectEqual(avx2_sums, sums, kBlockSize, "pixel");
      ++compared.slices;
    }
  }
}

TEST(Avx2Reader, ReadsClustersOfAnyRank) {
  if (!hasAvx2()) GTEST_SKIP() << "no AVX2";
  const test::OwnedMap map(100, 72, test::roughSurface(100, 72, 0.3f));
  const bake::NdfPyramidData pyramid = test::smallPyramid(map.map());
  for (const auto method : {CompressionMethod::cp, CompressionMethod::tucker, CompressionMethod::pca}) {
    // Columns are taken by eights and by fours, the last ones in a group that begins before them.
    for (const int rank : {1, 3, 4, 7, 8, 9, 13, 16}) {
      for (const auto type : {CoefficientType::i8, CoefficientType::f16, CoefficientType::f32}) {
        SCOPED_TRACE("method " + std::to_string(int(method)) + " rank " + std::to_string(rank) + " type " +
                     std::to_string(int(type)));
        bake::CompressionOptions c;
        c.method = method;
        c.coefficient_type = type;
        c.rank = rank;
        c.regions = 2;
        const bake::NdfCpData data = bake::compressPyramid(pyramid.view(), c);
        Compared compared;
        withReader(data.view(), [&](const auto& reader) { expectReadersAgree(data.view(), reader, compared); });
        EXPECT_GE(compared.columns, std::min(rank, 8));
        EXPECT_GT(compared.slices, 20);
        EXPECT_EQ(compared.alone > 0, method == CompressionMethod::cp);
      }
    }
  }
}

TEST(Avx2Reader, ReadsNarrowColumns) {
  if (!hasAvx2()) GTEST_SKIP() << "no AVX2";
  const test::OwnedMap map(200, 144, test::synthesised(bake::SynthKind::isotropic, 200, 144, 0.25f));
  const bake::NdfPyramidData pyramid = test::smallPyramid(map.map());
  for (const auto method : {CompressionMethod::tucker, CompressionMethod::pca}) {
    Compared compared;
    for (const double tolerance : {0.02, 0.05, 0.1, 0.2}) {
      SCOPED_TRACE("method " + std::to_string(int(method)) + " tolerance " + std::to_string(tolerance));
      bake::CompressionOptions c;
      c.method = method;
      c.tolerance = tolerance;
      const bake::NdfCpData data = bake::compressPyramid(pyramid.view(), c);
      withReader(data.view(), [&](const auto& reader) { expectReadersAgree(data.view(), reader, compared); });
    }
    EXPECT_GE(compared.narrow, 17);  // more than eight in each half
    EXPECT_TRUE(compared.odd);
  }
}

/// Blocks of random pixels, in half precision and as floats.
struct Blocks {
  std::vector<std::uint16_t> halves = std::vector<std::uint16_t>(8 * kBlockPixels);
  std::vector<float> floats = std::vector<float>(8 * kBlockPixels);

  explicit Blocks(std::mt19937& random) {
    for (std::size_t k = 0; k < halves.size(); ++k) {
      halves[k] = static_cast<std::uint16_t>(random() % (random() % 4 == 0 ? 0x400 : 0x7c00));  // subnormal ones, too
      floats[k] = halfToFloat(halves[k]);
    }
  }
};

TEST(Avx2Blocks, SumCoveredPixels) {
  if (!hasAvx2()) GTEST_SKIP() << "no AVX2";
  std::mt19937 random(2);
  std::uniform_real_distribution<float> unit(0, 1);
  for (int round = 0; round < 300; ++round) {
    const Blocks blocks(random);
    const float x = 16 * unit(random), y = 16 * unit(random);
    BlockCover cover;
    const Pixels kind = random() % 2 ? Pixels::smooth : Pixels::constant;
    const auto edge = [&](float position) { return BoxEdge(position, kind); };
    cover.set({edge(x), edge(x + (16 - x) * unit(random)), edge(y), edge(y + (16 - y) * unit(random))});
    const std::uint16_t* halves[8];
    const float* floats[8];
    float weights[8];
    for (int k = 0; k < 8; ++k) {
      halves[k] = blocks.halves.data() + k * kBlockPixels;
      floats[k] = blocks.floats.data() + k * kBlockPixels;
      weights[k] = unit(random);
    }
    const int count = static_cast<int>(random() % 9);
    ASSERT_EQ(sumCoveredPixels(halves, weights, count, cover.columns, cover.rows, cover.first_row, cover.end_row),
              cover.sumByFour(floats, weights, count))
        << round;
    ASSERT_EQ(cover.sumByFour(halves, weights, count), cover.sumByFour(floats, weights, count)) << round;
  }
}

TEST(Avx2Blocks, SumRows) {
  if (!hasAvx2()) GTEST_SKIP() << "no AVX2";
  std::mt19937 random(3);
  for (int round = 0; round < 100; ++round) {
    const Blocks blocks(random);
    float sums[kBlockSize], avx2_sums[kBlockSize];
    sumRows(blocks.floats.data()).store(sums);
    sumRowsAvx2(blocks.halves.data()).store(avx2_sums);
    expectEqual(avx2_sums, sums, kBlockSize, "row");
    sumRows(blocks.halves.data()).store(sums);
    expectEqual(avx2_sums, sums, kBlockSize, "row of halves");
  }
}

GLINT_AVX2 void convert(const std::uint16_t* halves, float* values, float* positive) {
  const __m128i eight = _mm_loadu_si128(reinterpret_cast<const __m128i*>(halves));
  _mm256_storeu_ps(values, floatsOf(eight));
  _mm256_storeu_ps(positive, positiveFloatsOf(eight));
}

/// All bits that a file may have.
TEST(Avx2, ConvertsHalfPrecisionNumbers) {
  if (!hasAvx2()) GTEST_SKIP() << "no AVX2";
  for (std::uint32_t first = 0; first < 0x10000; first += 8) {
    std::uint16_t halves[8];
    float values[8], positive[8];
    for (int k = 0; k < 8; ++k) halves[k] = static_cast<std::uint16_t>(first + static_cast<std::uint32_t>(k));
    convert(halves, values, positive);
    for (int k = 0; k < 8; ++k) {
      ASSERT_EQ(values[k], halfToFloat(halves[k])) << halves[k];
      ASSERT_EQ(positive[k], positiveHalfToFloat(halves[k])) << halves[k];
    }
  }
}

/// Infinities, and what is no number: values of a file are not checked when it is opened.
constexpr std::uint16_t kNoNumbers[] = {0x7c00, 0xfc00, 0x7e00, 0xfe00};

TEST(Avx2Reader, MakesNumbersOfWhatIsNone) {
  if (!hasAvx2()) GTEST_SKIP() << "no AVX2";
  const test::OwnedMap map(100, 72, test::roughSurface(100, 72, 0.3f));
  const bake::NdfPyramidData pyramid = test::smallPyramid(map.map());
  for (const auto method : {CompressionMethod::cp, CompressionMethod::tucker, CompressionMethod::pca}) {
    bake::CompressionOptions c;
    c.method = method;
    c.coefficient_type = CoefficientType::f16;
    c.rank = 9;
    const bake::NdfCpData data = bake::compressPyramid(pyramid.view(), c);
    NdfCp ndf = data.view();
    for (const std::uint16_t bits : kNoNumbers) {
      const std::vector<std::uint16_t> coefficients(1 << 20, bits);
      ndf.coefficients = coefficients.data();
      const CpNdf model(ndf);
      for (int k = 0; k < 50; ++k) {
        const float t = 0.02f * static_cast<float>(k);
        const Footprint p = Footprint::isotropic({t, 0.5f}, 8);
        const Vec2 h = {0.6f * t - 0.3f, 0.1f};
        ASSERT_TRUE(std::isfinite(model.density(p, h))) << bits;
        ASSERT_TRUE(std::isfinite(model.mean(p, {h, {h.x + 0.1f, h.y + 0.1f}}))) << bits;
        ASSERT_TRUE(std::isfinite(model.sample(p, {t, 0.5f}).pdf)) << bits;
      }
    }
  }
}

}  // namespace
}  // namespace glint::avx2_test

#endif
