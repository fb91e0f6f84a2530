#include "glint/bake/ingest_checks.h"

#include <algorithm>
#include <cmath>
#include <limits>

#include "glint/model/error.h"
#include "glint/model/texel_name.h"

namespace glint::bake {
namespace {

/// At most this many texels, evenly spread, are looked at to find the encoding.
constexpr std::size_t kSampleTexels = 65536;
/// Vectors this far from unit length are not a normal map's, and nor are those that point down.
constexpr double kFarFromUnit = 0.25;
/// Maps of flakes that were filtered have up to an eighth of such vectors; of colours spread over the cube it would be three
/// quarters.
constexpr double kMostFar = 0.3;
/// 0.5 becomes 0.735 when encoded as sRGB (a component of +0.47) and 0.214 when decoded (-0.57).
constexpr double kSrgbBias = 0.25;

double srgbToLinear(double v) { return v <= 0.04045 ? v / 12.92 : std::pow((v + 0.055) / 1.055, 2.4); }
double linearToSrgb(double v) { return v <= 0.0031308 ? v * 12.92 : 1.055 * std::pow(v, 1 / 2.4) - 0.055; }

[[noreturn]] void throwInvalid(const std::string& rule, const std::string& name, const std::string& object,
                               const std::string& what, const std::string& remedy) {
  throw Error(ErrorCode::invalid_input, rule, name, object, what, remedy);
}

double lengthError(double x, double y, double z) { return std::abs(std::sqrt(x * x + y * y + z * z) - 1); }

bool isFinite(float v) { return std::isfinite(v); }
bool isFinite(Vec2 v) { return std::isfinite(v.x) && std::isfinite(v.y); }

template <class T>
std::size_t fillHolesOf(int width, int height, std::vector<T>& values, const std::string& name) {
  std::vector<std::size_t> holes;
  for (std::size_t t = 0; t < values.size(); ++t) {
    if (!isFinite(values[t])) holes.push_back(t);
  }
  const std::size_t count = holes.size();
  if (2 * count > values.size()) {
    throwInvalid("map.repairable", name, "",
                 std::to_string(count) + " of " + std::to_string(values.size()) + " texels are unusable",
                 "more than half cannot be repaired; export the map again");
  }
  std::vector<std::pair<std::size_t, T>> filled;
  while (!holes.empty()) {
    filled.clear();
    for (const std::size_t t : holes) {
      const int i = static_cast<int>(t % static_cast<std::size_t>(width));
      const int j = static_cast<int>(t / static_cast<std::size_t>(width));
      T sum{};
      int usable = 0;
      for (int y = j + height - 1; y <= j + height + 1; ++y) {
        for (int x = i + width - 1; x <= i + width + 1; ++x) {
          const T neighbour = values[static_cast<std::size_t>(y % height) * width + static_cast<std::size_t>(x % width)];
          if (!isFinite(neighbour)) continue;
          sum = sum + neighbour;
          ++usable;
        }
      }
      if (usable > 0) filled.emplace_back(t, (1.0f / static_cast<float>(usable)) * sum);
    }
    for (const auto& [t, value] : filled) values[t] = value;
    std::erase_if(holes, [&](std::size_t t) { return isFinite(values[t]); });
  }
  return count;
}

}  // namespace

std::string texelName(const PixelArray& image, std::size_t texel) {
  return glint::texelName(image.width, image.height, texel);
}

void checkShape(const PixelArray& image, const std::string& name) {
  const auto count = std::visit([](const auto& pixels) { return pixels.size(); }, image.pixels);
  const bool fits = image.width > 0 && image.height > 0 && image.channels > 0 &&
                    count == static_cast<std::size_t>(image.width) * image.height * image.channels;
  if (!fits)
    throwInvalid("image.shape", name, "", "the image has no pixels or not as many as its size says", "export it again");
}

void checkNotConstant(const PixelArray& image, int channels, const std::string& name) {
  const bool constant = std::visit(
      [&](const auto& pixels) {
        const std::size_t stride = static_cast<std::size_t>(image.channels);
        for (std::size_t t = stride; t < pixels.size(); t += stride) {
          if (!std::equal(pixels.begin(), pixels.begin() + channels, pixels.begin() + static_cast<std::ptrdiff_t>(t)))
            return false;
        }
        return true;
      },
      image.pixels);
  if (constant) {
    throwInvalid("map.varies", name, "", "every texel has the same value",
                 "check the image, or pass --allow-constant if it is meant");
  }
}

float pixelValue(const PixelArray& image, std::size_t texel, int channel) {
  const std::size_t index = texel * static_cast<std::size_t>(image.channels) + static_cast<std::size_t>(channel);
  return std::visit(
      [&](const auto& pixels) {
        using T = typename std::decay_t<decltype(pixels)>::value_type;
        if constexpr (std::is_floating_point_v<T>) return pixels[index];
        return static_cast<float>(pixels[index]) / static_cast<float>(std::numeric_limits<T>::max());
      },
      image.pixels);
}

bool looksSigned(const EncodingEvidence& e) {
  // A map that was converted from sRGB is also nearer to unit length as snorm, but not this near.
  constexpr double kNearUnit = 0.01;
  return e.snorm < e.unorm && (e.negative || e.snorm < kNearUnit);
}

EncodingEvidence weighEncoding(const PixelArray& image, int channels) {
  const std::size_t texels = static_cast<std::size_t>(image.width) * image.height;
  const std::size_t step = std::max<std::size_t>(1, texels / kSampleTexels) | 1;  // odd: does not keep to some columns only
  EncodingEvidence e;
  double count = 0, far_unorm = 0, far_snorm = 0;
  for (std::size_t t = 0; t < texels; t += step) {
    const double v[3] = {pixelValue(image, t, 0), pixelValue(image, t, 1), channels > 2 ? pixelValue(image, t, 2) : 1.0};
    if (!std::isfinite(v[0] + v[1] + v[2])) continue;
    const auto error = [&](const auto& decode) { return lengthError(decode(v[0]), decode(v[1]), decode(v[2])); };
    const double unorm = error([](double c) { return 2 * c - 1; });
    const double snorm = error([](double c) { return c; });
    e.negative |= std::min({v[0], v[1], v[2]}) < 0;
    e.unorm += unorm;
    e.snorm += snorm;
    e.srgb_undone += error([](double c) { return 2 * srgbToLinear(c) - 1; });
    e.srgb_redone += error([](double c) { return 2 * linearToSrgb(c) - 1; });
    e.mean_x += 2 * v[0] - 1;
    e.mean_y += 2 * v[1] - 1;
    far_unorm += unorm > kFarFromUnit || 2 * v[2] - 1 <= 0 ? 1 : 0;
    far_snorm += snorm > kFarFromUnit || v[2] <= 0 ? 1 : 0;
    count += 1;
  }
  if (count == 0) return e;
  for (double* mean : {&e.unorm, &e.snorm, &e.srgb_undone, &e.srgb_redone, &e.mean_x, &e.mean_y}) *mean /= count;
  e.far_unorm = far_unorm / count;
  e.far_snorm = far_snorm / count;
  return e;
}

void checkEncoding(const EncodingEvidence& e, Encoding encoding, int channels, const std::string& name) {
  if (encoding == Encoding::unorm) {
    const bool three = channels > 2;
    if (std::min(e.mean_x, e.mean_y) > kSrgbBias && (!three || e.srgb_undone < 0.5 * e.unorm)) {
      throwInvalid("normals.linear", name, "", "the colours are sRGB-encoded: flat texels are near 0.735 instead of 0.5",
                   "export the map as non-colour (raw, linear) data");
    }
    if (std::max(e.mean_x, e.mean_y) < -kSrgbBias && (!three || e.srgb_redone < 0.5 * e.unorm)) {
      throwInvalid("normals.linear", name, "",
                   "the colours were converted from sRGB to linear: flat texels are near 0.214 instead of 0.5",
                   "export the map as non-colour (raw) data");
    }
  }
  const double far = encoding == Encoding::unorm ? e.far_unorm : e.far_snorm;
  if (channels > 2 && far > kMostFar) {
    throwInvalid("normals.unit", name, "",
                 std::to_string(std::lround(100 * far)) +
                     " % of the vectors point down or are far from unit length: this is no tangent-space normal map",
                 "give the normal map rather than the colour map or an object-space map, or set --encoding");
  }
}

std::size_t fillHoles(int width, int height, std::vector<Vec2>& values, const std::string& name) {
  return fillHolesOf(width, height, values, name);
}
std::size_t fillHoles(int width, int height, std::vector<float>& values, const std::string& name) {
  return fillHolesOf(width, height, values, name);
}

}  // namespace glint::bake
