#include "common/ndf_picture.h"

#include <algorithm>
#include <cmath>
#include <filesystem>

#include "common/image_formats.h"
#include "common/image_io.h"
#include "glint/model/error.h"

namespace glint::apps {

void checkPictureName(const std::string& path) {
  const std::string extension = std::filesystem::path(path).extension().string();
  if (extension == ".exr" || extension == ".png") return;
  throw Error(ErrorCode::usage, "image.extension", path, "", "an NDF image is written as .exr (densities) or .png (colours)",
              "change the extension");
}

std::vector<float> ndfColours(int size, std::span<const float> densities, float largest) {
  std::vector<float> grey(densities.size());
  const float scale = largest > 0 ? 1 / std::log1p(largest) : 0;
  std::transform(densities.begin(), densities.end(), grey.begin(),
                 [&](float d) { return scale * std::log1p(std::max(0.0f, d)); });
  return imageFormats().infernoColours(size, grey);
}

void writeColourPicture(const std::string& path, int size, std::span<const float> rgb) {
  checkPictureName(path);
  if (std::filesystem::path(path).extension() == ".exr") return writeImage(path, size, size, 3, rgb, PixelFormat::f32);
  const float largest = *std::max_element(rgb.begin(), rgb.end());
  const float scale = largest > 0 ? 1 / std::log1p(largest) : 0;
  std::vector<float> shown(rgb.size());
  for (std::size_t k = 0; k < rgb.size(); k += 3) {
    const float brightest = std::max({rgb[k], rgb[k + 1], rgb[k + 2], 0.0f});
    const float factor = brightest > 0 ? scale * std::log1p(brightest) / brightest : 0;
    for (std::size_t c = k; c < k + 3; ++c) shown[c] = factor * std::max(rgb[c], 0.0f);
  }
  writeImage(path, size, size, 3, shown, PixelFormat::u8);
}

void writeNdfPicture(const std::string& path, int size, std::span<const float> densities) {
  checkPictureName(path);
  if (std::filesystem::path(path).extension() == ".exr") return writeImage(path, size, size, 1, densities, PixelFormat::f32);
  const float largest = *std::max_element(densities.begin(), densities.end());
  writeImage(path, size, size, 3, ndfColours(size, densities, largest), PixelFormat::u8);
}

}  // namespace glint::apps
