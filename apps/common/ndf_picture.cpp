#include "common/ndf_picture.h"

#include <OpenImageIO/imagebuf.h>
#include <OpenImageIO/imagebufalgo.h>

#include <algorithm>
#include <cmath>
#include <filesystem>

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
  const OIIO::ImageSpec grey_spec(size, size, 1, OIIO::TypeDesc::FLOAT), colour_spec(size, size, 3, OIIO::TypeDesc::FLOAT);
  const OIIO::ImageBuf source(grey_spec, grey.data());
  std::vector<float> colours(3 * densities.size());
  OIIO::ImageBuf target(colour_spec, colours.data());
  if (!OIIO::ImageBufAlgo::color_map(target, source, 0, "inferno"))
    throw Error(ErrorCode::failed, "image.colours", "", "", target.geterror());
  return colours;
}

void writeNdfPicture(const std::string& path, int size, std::span<const float> densities) {
  checkPictureName(path);
  if (std::filesystem::path(path).extension() == ".exr") return writeImage(path, size, size, 1, densities, PixelFormat::f32);
  const float largest = *std::max_element(densities.begin(), densities.end());
  writeImage(path, size, size, 3, ndfColours(size, densities, largest), PixelFormat::u8);
}

}  // namespace glint::apps
