#include <gtest/gtest.h>

#include <cmath>
#include <cstdint>
#include <cstring>
#include <memory>
#include <random>
#include <vector>

#include "glint/api/pack.h"
#include "glint/formats/asset_writer.h"
#include "glint/query/packed_ndf_view.h"
#include "glint/query/reference.h"
#include "support/sample_assets.h"
#include "support/temp_folder.h"

namespace glint::packed_ndf_test {
namespace {

constexpr int kSize = 64;

/// A copy of a buffer at another address: `offset` bytes after a multiple of 64.
class Relocated {
 public:
  Relocated(std::vector<std::byte> buffer, std::size_t offset) : memory_(buffer.size() + offset + kPackedAlignment) {
    void* at = memory_.data();
    std::size_t space = memory_.size();
    copy_ = static_cast<std::byte*>(std::align(kPackedAlignment, buffer.size(), at, space)) + offset;
    std::memcpy(copy_, buffer.data(), buffer.size());
    std::memset(buffer.data(), 0xa5, buffer.size());  // nothing may still look there
  }
  const void* data() const { return copy_; }

 private:
  std::vector<std::byte> memory_;
  std::byte* copy_;
};

/// Sums over texels take a thousand times as long as the rest.
constexpr int kFewQueries = 30;

template <class Model>
void expectSameBits(const Model& actual, const Model& expected, int queries = 300) {
  std::mt19937 random(1);
  std::uniform_real_distribution<float> unit(0, 1);
  int positive = 0;
  for (int k = 0; k < queries; ++k) {
    const Vec2 uv = {unit(random), unit(random)};
    const Footprint p = Footprint::isotropic(uv, 0.5f * std::exp2(5 * unit(random)));
    const Vec2 h = {unit(random) - 0.5f, unit(random) - 0.5f};
    const Box2 range = {h, h + Vec2{0.3f * unit(random), 0.2f}};
    ASSERT_EQ(actual.density(p, h), expected.density(p, h));
    ASSERT_EQ(actual.mean(p, range), expected.mean(p, range));
    positive += expected.density(p, h) > 0;
  }
  EXPECT_GT(positive, queries / 30);
}

TEST(PackedNdf, MovedPyramidsAnswerBitForBit) {
  const auto map = test::sampleNormals(kSize, kSize);
  for (const auto precision : {BlockPrecision::f16, BlockPrecision::f32}) {
    const auto sample = test::samplePyramid(kSize, precision);
    for (const std::size_t offset : {0, 16, 48}) {
      const Relocated alone(api::pack(sample.pyramid), offset);
      const PackedNdfView view(alone.data());
      ASSERT_EQ(view.kind(), PackedKind::pyramid);
      EXPECT_FALSE(view.hasNormals());
      expectSameBits(view.pyramidNdf(), PyramidNdf(sample.pyramid));
      const Relocated with_normals(api::pack(sample.pyramid, &map.map), offset);
      expectSameBits(PackedNdfView(with_normals.data()).pyramidNdf(), PyramidNdf(sample.pyramid, map.map), kFewQueries);
    }
  }
}

TEST(PackedNdf, BuffersOfOtherVersionsAndNoBuffersAreKnown) {
  const auto sample = test::samplePyramid(kSize, BlockPrecision::f16);
  const std::vector<std::byte> good = api::pack(sample.pyramid);
  const auto fault = [&](std::size_t place, std::size_t size) -> std::string {
    std::vector<std::byte> changed = good;
    if (place < changed.size()) changed[place] ^= std::byte{1};
    const Relocated buffer(changed, 0);
    EXPECT_EQ(PackedNdfView(buffer.data()).kind(), place < 8 ? PackedKind::unknown : PackedKind::pyramid);
    try {
      api::viewPacked({static_cast<const std::byte*>(buffer.data()), size});
      return "";
    } catch (const Error& error) {
      EXPECT_EQ(error.code(), ErrorCode::invalid_input);
      return error.what();
    }
  };
  constexpr std::size_t kMagic = 0, kVersion = 4, kNone = SIZE_MAX;
  EXPECT_EQ(fault(kNone, good.size()), "");
  EXPECT_NE(fault(kMagic, good.size()).find("no packed buffer"), std::string::npos);
  EXPECT_NE(fault(kVersion, good.size()).find("version"), std::string::npos);
  EXPECT_NE(fault(kNone, good.size() - 64).find("not whole"), std::string::npos);
  EXPECT_NE(fault(kNone, 100).find("no header"), std::string::npos);
}

TEST(PackedNdf, KindsWithoutAPackedFormAreNamed) {
  const test::TempFolder folder;
  formats::writeAsset(folder / "bins.glint", test::sampleBinMap(kSize, kSize).map, test::sampleProvenance());
  formats::writeAsset(folder / "sums.glint", test::sampleHistograms(kSize, kSize).sat, test::sampleProvenance());
  for (const char* name : {"bins.glint", "sums.glint"}) {
    const api::OpenedNdf opened = api::OpenedNdf::open(folder / name);
    try {
      api::pack(opened);
      ADD_FAILURE() << name;
    } catch (const Error& error) {
      EXPECT_EQ(error.code(), ErrorCode::unsupported);
      EXPECT_NE(std::string(error.what()).find("no packed form"), std::string::npos) << error.what();
      EXPECT_EQ(error.path(), (folder / name).string());
    }
  }
}

TEST(PackedNdf, MovedCompressionsAnswerBitForBit) {
  const auto map = test::sampleNormals(kSize, kSize);
  for (const auto method : {CompressionMethod::cp, CompressionMethod::tucker, CompressionMethod::pca}) {
    for (const auto type : {CoefficientType::i8, CoefficientType::f16, CoefficientType::f32}) {
      const auto sample = test::sampleNdfCp(kSize, method, type);
      const Relocated alone(api::pack(sample.ndf), 16);
      ASSERT_EQ(PackedNdfView(alone.data()).kind(), PackedKind::compressed);
      expectSameBits(PackedNdfView(alone.data()).cpNdf(), CpNdf(sample.ndf));
      const Relocated with_normals(api::pack(sample.ndf, &map.map), 32);
      expectSameBits(PackedNdfView(with_normals.data()).cpNdf(), CpNdf(sample.ndf, map.map), kFewQueries);
    }
  }
}

TEST(PackedNdf, MovedNormalsAnswerBitForBit) {
  for (const bool bounds : {true, false}) {
    const auto map = test::sampleNormals(kSize, 48, bounds);
    for (const Surface surface : {Surface::flat, Surface::smooth}) {
      const Relocated moved(api::pack(map.map, 0.05f, surface, Boundary::clamp), 16);
      expectSameBits(PackedNdfView(moved.data()).reference(),
                     Reference(map.map, 0.05f, surface, Boundary::clamp, Reference::Search::pruned), kFewQueries);
    }
  }
}

TEST(PackedNdf, HeaderAndArraysMayBeInDifferentMemories) {
  // As with a GPU: the header is read here, and the arrays are at an address that only those who ask can read.
  const auto sample = test::sampleNdfCp(kSize, CompressionMethod::cp, CoefficientType::i8);
  const std::vector<std::byte> buffer = api::pack(sample.ndf);
  PackedHeader header;
  std::memcpy(&header, buffer.data(), sizeof header);
  const void* elsewhere = reinterpret_cast<const void*>(std::uintptr_t{0x10000});
  const NdfCp view = PackedNdfView(header, elsewhere).ndfCp();
  EXPECT_EQ(reinterpret_cast<std::uintptr_t>(view.masks.data()), 0x10000 + header.arrays[4].offset);
  EXPECT_EQ(view.masks.size(), sample.ndf.masks.size());
}

TEST(PackedNdf, CarriesTheSlopesOfTheMap) {
  auto sample = test::samplePyramid(kSize, BlockPrecision::f16);
  sample.pyramid.shape.slopes = {{0.25f, -0.5f}, {1, 2, 3}};
  const Relocated moved(api::pack(sample.pyramid), 0);
  const MapSlopes slopes = PackedNdfView(moved.data()).pyramid().shape.slopes;
  EXPECT_EQ(slopes.mean, sample.pyramid.shape.slopes.mean);
  EXPECT_EQ(slopes.covariance.xx, 1);
  EXPECT_EQ(slopes.covariance.xy, 2);
  EXPECT_EQ(slopes.covariance.yy, 3);
}

TEST(PackedNdf, LayoutIsAsDocumented) {
  const auto map = test::sampleNormals(kSize, kSize);
  const auto sample = test::samplePyramid(kSize, BlockPrecision::f16);
  const std::vector<std::byte> buffer = api::pack(sample.pyramid, &map.map);
  EXPECT_EQ(buffer, api::pack(sample.pyramid, &map.map));
  PackedHeader header;
  std::memcpy(&header, buffer.data(), sizeof header);
  EXPECT_EQ(header.magic, kPackedMagic);
  EXPECT_EQ(header.version, kPackedVersion);
  EXPECT_EQ(header.size_bytes, buffer.size());
  EXPECT_EQ(header.width, kSize);
  std::uint64_t end = sizeof(PackedHeader);
  const auto follows = [&](const PackedArray& array, std::size_t element_bytes) {
    EXPECT_EQ(array.offset, end);
    EXPECT_EQ(array.offset % kPackedAlignment, 0u);
    end = (array.offset + array.count * element_bytes + kPackedAlignment - 1) / kPackedAlignment * kPackedAlignment;
  };
  for (int l = 0; l < header.level_count; ++l) {
    follows(header.arrays[4 * l], 8);
    follows(header.arrays[4 * l + 1], 4);
    follows(header.arrays[4 * l + 2], 4);
    follows(header.arrays[4 * l + 3], 2);
  }
  follows(header.normals, 8);
  for (int k = 0; k < header.bounds_level_count; ++k) follows(header.bounds[k], 16);
  EXPECT_EQ(end, buffer.size());
}

}  // namespace
}  // namespace glint::packed_ndf_test
