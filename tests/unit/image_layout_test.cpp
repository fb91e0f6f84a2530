#include "common/image_layout.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>

#include "common/tiff_tags.h"
#include "glint/model/error.h"

namespace glint::apps::image_layout_test {
namespace {

/// Pixels of one channel, given from the top.
StoredImage image(int width, int height, std::vector<std::uint8_t> from_top) {
  PixelVector<std::uint8_t> pixels;
  for (int j = height - 1; j >= 0; --j)
    pixels.insert(pixels.end(), from_top.begin() + j * width, from_top.begin() + (j + 1) * width);
  StoredImage stored;
  stored.image.width = width, stored.image.height = height, stored.image.channels = 1;
  stored.image.channel_names = {"Y"};
  stored.image.pixels = pixels;
  stored.display = {0, 0, width, height};
  return stored;
}

std::vector<std::uint8_t> fromTop(const StoredImage& stored) {
  const auto& pixels = std::get<PixelVector<std::uint8_t>>(stored.image.pixels);
  std::vector<std::uint8_t> top;
  for (int j = stored.image.height - 1; j >= 0; --j)
    top.insert(top.end(), pixels.begin() + j * stored.image.width, pixels.begin() + (j + 1) * stored.image.width);
  return top;
}

TEST(Orient, ShowsWhatExifMeans) {
  // 1 2 3
  // 4 5 6
  const std::vector<std::vector<std::uint8_t>> shown = {{1, 2, 3, 4, 5, 6}, {3, 2, 1, 6, 5, 4}, {6, 5, 4, 3, 2, 1},
                                                        {4, 5, 6, 1, 2, 3}, {1, 4, 2, 5, 3, 6}, {4, 1, 5, 2, 6, 3},
                                                        {6, 3, 5, 2, 4, 1}, {3, 6, 2, 5, 1, 4}};
  for (int orientation = 1; orientation <= 8; ++orientation) {
    StoredImage stored = image(3, 2, {1, 2, 3, 4, 5, 6});
    stored.orientation = orientation;
    orient(stored);
    EXPECT_EQ(fromTop(stored), shown[static_cast<std::size_t>(orientation - 1)]) << orientation;
    EXPECT_EQ(stored.image.width, orientation < 5 ? 3 : 2);
  }
}

TEST(CropToDisplay, CutsOverscanOffAndNotesIt) {
  StoredImage stored = image(4, 3, {1, 2, 3, 4, 5, 6, 7, 8, 9, 10, 11, 12});
  stored.display = {1, 1, 2, 1};
  cropToDisplay(stored, {}, "a.exr");
  EXPECT_EQ(fromTop(stored), (std::vector<std::uint8_t>{6, 7}));
  EXPECT_EQ(stored.image.notes.size(), 1u);
}

TEST(CropToDisplay, CountsMissingPixels) {
  StoredImage stored = image(2, 2, {1, 2, 3, 4});
  stored.display = {-1, 1, 3, 2};  // of its six pixels two are stored
  try {
    cropToDisplay(stored, {}, "a.exr");
    FAIL();
  } catch (const Error& error) {
    EXPECT_NE(std::string(error.what()).find("4 are missing"), std::string::npos) << error.what();
  }
}

Image rgba(PixelVector<float> pixels) {
  Image image;
  image.width = std::max(1, static_cast<int>(pixels.size() / 4)), image.height = 1, image.channels = 4, image.alpha = 3;
  image.channel_names = {"R", "G", "B", "A"};
  image.floating = image.associated = true;
  image.pixels = std::move(pixels);
  return image;
}

TEST(DivideByAlpha, GivesStraightColours) {
  Image half = rgba({0.25f, 0.1f, 0.5f, 0.5f, 0.2f, 0.3f, 0.4f, 1});
  divideByAlpha(half, {}, "a.exr");
  EXPECT_EQ(std::get<PixelVector<float>>(half.pixels), (PixelVector<float>{0.5f, 0.2f, 1, 0.5f, 0.2f, 0.3f, 0.4f, 1}));
}

TEST(DivideByAlpha, KeepsTheCodesOfOpaqueImages) {
  Image opaque = rgba({});
  opaque.pixels = PixelVector<std::uint8_t>{1, 2, 3, 255};
  divideByAlpha(opaque, {}, "a.tif");
  EXPECT_EQ(std::get<PixelVector<std::uint8_t>>(opaque.pixels), (PixelVector<std::uint8_t>{1, 2, 3, 255}));
}

TEST(DivideByAlpha, RefusesCodesThatWereNotMultiplied) {
  Image straight = rgba({});
  straight.pixels = PixelVector<std::uint8_t>{200, 2, 3, 100};
  EXPECT_THROW(divideByAlpha(straight, {}, "a.tif"), Error);
}

TEST(DivideByAlpha, TransparentPixelsAreHolesOnlyWhereWanted) {
  Image empty = rgba({0, 0, 0, 0, 0.2f, 0.3f, 0.4f, 1});
  EXPECT_THROW(divideByAlpha(empty, {}, "a.exr"), Error);
  divideByAlpha(empty, {.transparent_holes = true}, "a.exr");
  EXPECT_TRUE(std::isnan(std::get<PixelVector<float>>(empty.pixels)[0]));
}

TEST(FindChannels, TakesNamesBeforePlaces) {
  Image image = rgba({});
  EXPECT_EQ(findChannels(image, "ag", "a"), (std::vector<int>{3, 1}));
  EXPECT_EQ(findChannels(image, "XYZ", "a"), (std::vector<int>{0, 1, 2}));
  EXPECT_EQ(findChannels(image, "B,R", "a"), (std::vector<int>{2, 0}));
  image.channel_names = {"n.Z", "n.Y", "n.X", "A"};
  EXPECT_EQ(findChannels(image, "xyz", "a"), (std::vector<int>{2, 1, 0}));
  EXPECT_EQ(findChannels(image, "n.X,n.Z", "a"), (std::vector<int>{2, 0}));
  EXPECT_THROW(findChannels(image, "xq", "a"), Error);
  EXPECT_THROW(findChannels(image, "n.X,n.Q", "a"), Error);
}

TEST(SelectLayer, KeepsTheChannelsOfOneLayer) {
  Image image;
  image.width = image.height = 1, image.channels = 3;
  image.channel_names = {"a.X", "b.X", "b.Y"};
  image.pixels = PixelVector<std::uint8_t>{1, 2, 3};
  Image first = image;
  selectLayer(first, "", "l.exr");
  EXPECT_EQ(first.layers, (std::vector<std::string>{"a", "b"}));
  EXPECT_EQ(first.channel_names, (std::vector<std::string>{"a.X"}));
  selectLayer(image, "b", "l.exr");
  EXPECT_EQ(std::get<PixelVector<std::uint8_t>>(image.pixels), (PixelVector<std::uint8_t>{2, 3}));
}

TEST(ExifOrientation, IsOneUnlessTheMetadataSayMore) {
  std::vector<unsigned char> exif = {'I', 'I', 42, 0, 8, 0, 0, 0, 1, 0, 0x12, 1, 3, 0, 1, 0, 0, 0, 6, 0, 0, 0, 0, 0, 0, 0};
  EXPECT_EQ(exifOrientation(std::as_bytes(std::span(exif))), 6);
  for (std::size_t size = 0; size < exif.size() - 6; ++size)  // the value ends six bytes before the end
    EXPECT_EQ(exifOrientation(std::as_bytes(std::span(exif).first(size))), 1) << size;
  exif[18] = 9;
  EXPECT_EQ(exifOrientation(std::as_bytes(std::span(exif))), 1);
}

}  // namespace
}  // namespace glint::apps::image_layout_test
