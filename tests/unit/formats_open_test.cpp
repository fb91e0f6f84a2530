#include <gmock/gmock.h>
#include <gtest/gtest.h>
#include <sys/resource.h>

#include <cstring>
#include <filesystem>
#include <thread>
#include <vector>

#include "glint/formats/asset_reader.h"
#include "glint/formats/asset_writer.h"
#include "support/hdf5_bytes.h"
#include "support/sample_assets.h"
#include "support/temp_folder.h"

namespace glint::formats::formats_open_test {
namespace {

namespace fs = std::filesystem;

/// A file of a map of heights, and its bytes at a multiple of 64.
class OpenTest : public testing::Test {
 protected:
  OpenTest() : path_(folder_ / "a.glint") {
    writeAsset(path_, sample_.map, test::sampleProvenance());
    const test::Bytes file = test::readBytes(path_.string());
    lines_.resize(file.size() / sizeof(Line) + 2);
    bytes_ = std::as_writable_bytes(std::span(lines_)).first(file.size());
    std::memcpy(bytes_.data(), file.data(), file.size());
  }

  void expectSample(const Asset& asset) const {
    const auto heights = asset.get<HeightMap>().heights;
    ASSERT_EQ(heights.size(), sample_.map.heights.size());
    EXPECT_EQ(std::memcmp(heights.data(), sample_.map.heights.data(), heights.size_bytes()), 0);
    EXPECT_EQ(asset.info().provenance, test::sampleProvenance());
    EXPECT_EQ(asset.info().file_bytes, bytes_.size());
  }

  /// Whether the heights of an asset lie in the bytes of this test.
  bool isInPlace(const Asset& asset) const {
    const auto* first = reinterpret_cast<const std::byte*>(asset.get<HeightMap>().heights.data());
    return first >= bytes_.data() && first < bytes_.data() + bytes_.size();
  }

  static std::string messageOf(const AssetSource& source) {
    try {
      Asset::openSource(source);
      return "";
    } catch (const Error& error) {
      EXPECT_EQ(error.code(), ErrorCode::io);
      return error.what();
    }
  }

  struct alignas(64) Line {
    std::byte bytes[64];
  };
  test::TempFolder folder_;
  fs::path path_;
  decltype(test::sampleHeights(16, 16)) sample_ = test::sampleHeights(16, 16);
  std::vector<Line> lines_;
  std::span<std::byte> bytes_;
};

TEST_F(OpenTest, BytesInMemoryAreUsedInPlace) {
  const Asset asset = Asset::openMemory(bytes_, "memory");
  expectSample(asset);
  EXPECT_TRUE(isInPlace(asset));
}

TEST_F(OpenTest, BytesInMemoryAreCopiedOnRequest) {
  const Asset asset = Asset::openMemory(bytes_, "memory", {.copy = true});
  EXPECT_FALSE(isInPlace(asset));
  std::memset(bytes_.data(), 0, bytes_.size());
  expectSample(asset);
}

TEST_F(OpenTest, BytesInMemoryMayStartAnywhere) {
  for (std::size_t shift = 1; shift < 64; ++shift) {
    std::vector<std::byte> shifted(shift + bytes_.size());
    std::memcpy(shifted.data() + shift, bytes_.data(), bytes_.size());
    const Asset asset = Asset::openMemory(std::span(shifted).subspan(shift), "memory");
    expectSample(asset);
    EXPECT_EQ(reinterpret_cast<std::uintptr_t>(asset.get<HeightMap>().heights.data()) % 64, 0u);
  }
}

TEST_F(OpenTest, ErrorsNameBytesInMemory) {
  for (const std::size_t size : {std::size_t{0}, std::size_t{7}, std::size_t{47}, bytes_.size() - 1}) {
    try {
      Asset::openMemory(bytes_.first(size), "shelf 7");
      ADD_FAILURE() << size;
    } catch (const Error& error) {
      EXPECT_THAT(error.what(), testing::StartsWith("shelf 7: "));
      EXPECT_THAT(error.rule(), testing::AnyOf("file.signature", "file.truncated"));
    }
  }
}

TEST_F(OpenTest, AFunctionMayReadTheBytes) {
  std::uint64_t asked = 0;
  const auto read = [&](std::uint64_t offset, std::span<std::byte> to) {
    EXPECT_LE(offset + to.size(), bytes_.size());
    asked += to.size();
    std::memcpy(to.data(), bytes_.data() + offset, to.size());
    return true;
  };
  expectSample(Asset::openSource({"archive", bytes_.size(), read}, {true, true}));
  EXPECT_EQ(asked, bytes_.size());
}

TEST_F(OpenTest, AFunctionThatCannotReadIsAnErrorOfInput) {
  EXPECT_THAT(messageOf({"archive", bytes_.size(), [](std::uint64_t, std::span<std::byte>) { return false; }}),
              testing::StartsWith("archive: cannot be read at offset 0"));
}

TEST_F(OpenTest, TooFewDescriptorsAreNotDamage) {
  rlimit all = {};
  ASSERT_EQ(getrlimit(RLIMIT_NOFILE, &all), 0);
  const rlimit none = {0, all.rlim_max};
  ASSERT_EQ(setrlimit(RLIMIT_NOFILE, &none), 0);
  std::string message;
  try {
    Asset::open(path_);
  } catch (const Error& error) {
    message = error.what();
    EXPECT_EQ(error.code(), ErrorCode::io);
  }
  ASSERT_EQ(setrlimit(RLIMIT_NOFILE, &all), 0);
  EXPECT_THAT(message, testing::HasSubstr("Too many open files"));
}

TEST_F(OpenTest, ACopyOutlivesATruncatedFile) {
  const Asset asset = Asset::open(path_, {.copy = true});
  fs::resize_file(path_, 0);
  expectSample(asset);
}

TEST_F(OpenTest, ManyThreadsOpenAtOnce) {
  std::vector<std::thread> threads;
  for (int k = 0; k < 8; ++k) {
    threads.emplace_back([&, k] {
      for (int repeat = 0; repeat < 50; ++repeat) {
        if (k % 2 == 0) {
          expectSample(Asset::open(path_));
        } else {
          EXPECT_THROW(Asset::openMemory(bytes_.first(100), "memory"), Error);
        }
      }
    });
  }
  for (std::thread& thread : threads) thread.join();
}

}  // namespace
}  // namespace glint::formats::formats_open_test
