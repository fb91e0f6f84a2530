#include "common/normal_image.h"

#include <tbb/parallel_for.h>

#include <algorithm>
#include <cmath>
#include <filesystem>

#include "glint/model/error.h"

namespace glint::apps {
namespace {

/// The one format with floating-point pixels that is written here.
bool isFloatImageName(const std::string& path) {
  std::string extension = std::filesystem::path(path).extension().string();
  std::transform(extension.begin(), extension.end(), extension.begin(), [](unsigned char c) { return std::tolower(c); });
  return extension == ".exr";
}

}  // namespace

std::vector<float> encodeNormals(std::span<const Vec2> normals) {
  std::vector<float> colours(3 * normals.size());
  tbb::parallel_for(std::size_t{0}, normals.size(), [&](std::size_t i) {
    const Vec2 n = normals[i];
    const float z = std::sqrt(std::max(0.0f, 1 - dot(n, n)));
    colours[3 * i] = 0.5f + 0.5f * n.x;
    colours[3 * i + 1] = 0.5f + 0.5f * n.y;
    colours[3 * i + 2] = 0.5f + 0.5f * z;
  });
  return colours;
}

int pixelBits(const std::string& path, int wanted) {
  const bool floating = isFloatImageName(path);
  if (wanted == 0) return floating ? 32 : 8;
  if (wanted == 16 || wanted == (floating ? 32 : 8)) return wanted;
  throw Error(ErrorCode::usage, "image.bits", path, "",
              "the format does not hold " + std::to_string(wanted) + " bits a channel",
              floating ? "use --bits 16 or 32" : "use --bits 8 or 16, or name the output .exr");
}

PixelFormat pixelFormat(const std::string& path, int bits) {
  if (isFloatImageName(path)) return bits == 16 ? PixelFormat::f16 : PixelFormat::f32;
  return bits == 16 ? PixelFormat::u16 : PixelFormat::u8;
}

void requireFloatImage(const std::string& path, bool needed, const std::string& what) {
  if (!needed || isFloatImageName(path)) return;
  throw Error(ErrorCode::usage, "image.float", path, "",
              "the format holds 0 to 1 only, and " + what + " are not confined to it", "name the output .exr");
}

}  // namespace glint::apps
