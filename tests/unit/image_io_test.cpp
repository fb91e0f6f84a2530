#include "common/image_io.h"

#include <gtest/gtest.h>
#include <unistd.h>

#include <filesystem>

#include "common/files.h"
#include "common/image_formats.h"
#include "common/normal_image.h"
#include "glint/formats/atomic_file.h"
#include "glint/model/error.h"

namespace glint::apps::image_io_test {
namespace {

constexpr std::uint64_t kPlenty = std::uint64_t{1} << 40;  // bytes: more than any image of these tests takes

class ImageFile : public ::testing::Test {
 protected:
  void SetUp() override {
    folder_ = std::filesystem::path(::testing::TempDir()) / ("glint_image_" + std::to_string(::getpid()));
    std::filesystem::create_directories(folder_);
  }
  void TearDown() override { std::filesystem::remove_all(folder_); }
  std::string path(const std::string& name) const { return (folder_ / name).string(); }

  /// 3 x 2, three channels; the red of each texel tells its place.
  std::vector<float> pixels_ = {0.0f, 0.1f, 1, 0.2f, 0.1f, 1, 0.4f, 0.1f, 1,   // bottom row
                                0.6f, 0.1f, 1, 0.8f, 0.1f, 1, 1.0f, 0.1f, 1};  // top row
  std::filesystem::path folder_;
};

TEST_F(ImageFile, FloatsComeBackBottomRowFirst) {
  writeImage(path("a.exr"), 3, 2, 3, pixels_, PixelFormat::f32);
  const Image image = readImage(path("a.exr"));
  EXPECT_EQ(image.width, 3);
  EXPECT_EQ(image.height, 2);
  EXPECT_TRUE(image.floating);
  EXPECT_EQ(std::get<PixelVector<float>>(image.pixels), PixelVector<float>(pixels_.begin(), pixels_.end()));
}

TEST_F(ImageFile, IntegersKeepTheirCodes) {
  writeImage(path("a.png"), 3, 2, 3, pixels_, PixelFormat::u8);
  writeImage(path("b.png"), 3, 2, 3, pixels_, PixelFormat::u16);
  EXPECT_EQ(std::get<PixelVector<std::uint8_t>>(readImage(path("a.png")).pixels)[3], 51);
  EXPECT_EQ(std::get<PixelVector<std::uint16_t>>(readImage(path("b.png")).pixels)[3], 13107);
  EXPECT_EQ(readImage(path("b.png")).bits, 16);
}

/// PNGs of every colour type, read by libpng and by OpenImageIO: two readers, one answer.
TEST_F(ImageFile, ReadsPngAsOpenImageIoDoes) {
  std::vector<float> pixels;
  for (int i = 0; i < 13 * 7 * 4; ++i) pixels.push_back(static_cast<float>((i * 7919) % 251) / 250);
  for (int channels = 1; channels <= 4; ++channels) {
    for (const PixelFormat format : {PixelFormat::u8, PixelFormat::u16}) {
      writeImage(path("a.png"), 13, 7, channels, std::span(pixels).first(13 * 7 * channels), format);
      const Image direct = readImage(path("a.png")), other = imageFormats().read(path("a.png"), "", "", kPlenty).image;
      EXPECT_EQ(direct.channels, channels);
      EXPECT_EQ(direct.channel_names, other.channel_names);
      EXPECT_EQ(direct.bits, other.bits);
      EXPECT_EQ(direct.format, other.format);
      EXPECT_EQ(direct.pixels, other.pixels) << channels;
    }
  }
}

TEST_F(ImageFile, RefusesSizesThatTheFileCannotHold) {
  writeImage(path("a.png"), 3, 2, 3, pixels_, PixelFormat::u8);
  EXPECT_NO_THROW(checkDeclaredSize(path("a.png"), "png", std::uint64_t{1} << 20, kPlenty));
  EXPECT_THROW(checkDeclaredSize(path("a.png"), "png", std::uint64_t{1} << 40, kPlenty), Error);
  EXPECT_THROW(checkDeclaredSize(path("a.png"), "png", std::uint64_t{1} << 20, std::uint64_t{1} << 19), Error);
  EXPECT_THROW(checkDeclaredSize(path("a.png"), "pnm", std::uint64_t{1} << 20, kPlenty), Error);
}

TEST_F(ImageFile, FilesStoreTheTopRowFirst) {
  writeImage(path("a.ppm"), 3, 2, 3, pixels_, PixelFormat::u8);
  const auto bytes = readFile(path("a.ppm"));
  EXPECT_EQ(std::to_integer<int>(bytes[bytes.size() - 9]), 0);  // the last row in the file is the bottom row
}

TEST_F(ImageFile, SameBytesEveryTime) {
  for (const char* name : {"a.exr", "a.png"}) {
    const PixelFormat format = std::string(name) == "a.exr" ? PixelFormat::f32 : PixelFormat::u8;
    writeImage(path(name), 3, 2, 3, pixels_, format);
    const auto first = readFile(path(name));
    ::sleep(1);  // a time stamp of the second would show
    writeImage(path(name), 3, 2, 3, pixels_, format);
    EXPECT_EQ(first, readFile(path(name))) << name;
  }
}

TEST_F(ImageFile, EveryTruncationIsAnError) {
  std::vector<float> large;
  for (int i = 0; i < 64 * 64 * 3; ++i) large.push_back(static_cast<float>((i * 7919) % 256) / 255);
  for (const char* name : {"a.exr", "a.png", "a.tif", "a.jpg", "a.ppm"}) {
    writeImage(path(name), 64, 64, 3, large, std::string(name) == "a.exr" ? PixelFormat::f32 : PixelFormat::u8);
    const auto bytes = readFile(path(name));
    // The last bytes of some formats carry no pixels, so the longest prefix ends 64 bytes before the end.
    for (const std::size_t size : {std::size_t{0}, std::size_t{3}, bytes.size() / 4, bytes.size() / 2, bytes.size() - 64}) {
      formats::writeFile(path(name), std::span(bytes).first(size));
      try {
        readImage(path(name));
        ADD_FAILURE() << name << " of " << size << " bytes was read";
      } catch (const Error& error) {
        EXPECT_EQ(error.code(), ErrorCode::invalid_input);
        EXPECT_EQ(error.path(), path(name));
      }
    }
  }
}

TEST_F(ImageFile, RefusesWhatTheFormatCannotHold) {
  std::vector<float> outside = pixels_;
  outside[0] = 1.5f;
  EXPECT_THROW(writeImage(path("a.png"), 3, 2, 3, outside, PixelFormat::u8), Error);
  EXPECT_THROW(writeImage(path("a.png"), 3, 2, 3, pixels_, PixelFormat::f32), Error);
  EXPECT_THROW(writeImage(path("a.nonsense"), 3, 2, 3, pixels_, PixelFormat::u8), Error);
  EXPECT_TRUE(std::filesystem::is_empty(folder_));
}

TEST_F(ImageFile, MissingFilesAndOtherContentsAreTold) {
  try {
    readImage(path("none.png"));
    FAIL();
  } catch (const Error& error) {
    EXPECT_EQ(error.code(), ErrorCode::io);
  }
  writeTextFile(path("text.png"), "not an image");
  EXPECT_THROW(readImage(path("text.png")), Error);
}

TEST(NormalImage, EncodesUpAsHalfHalfOne) {
  const std::vector<Vec2> normals = {{0, 0}, {-0.6f, 0.8f}};
  EXPECT_EQ(encodeNormals(std::span(normals).first(1)), (std::vector<float>{0.5f, 0.5f, 1}));
  EXPECT_NEAR(encodeNormals(normals)[3], 0.2f, 1e-6f);
}

TEST(NormalImage, ChecksBitsAgainstTheFormat) {
  EXPECT_EQ(pixelBits("a.png", 0), 8);
  EXPECT_EQ(pixelBits("a.EXR", 0), 32);
  EXPECT_EQ(pixelBits("a.exr", 16), 16);
  EXPECT_THROW(pixelBits("a.png", 32), Error);
  EXPECT_THROW(pixelBits("a.exr", 8), Error);
  EXPECT_THROW(requireFloatImage("a.png", true, "heights"), Error);
}

}  // namespace
}  // namespace glint::apps::image_io_test
