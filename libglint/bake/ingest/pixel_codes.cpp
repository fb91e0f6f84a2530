#include "glint/bake/ingest/pixel_codes.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <cstdint>
#include <limits>
#include <utility>
#include <vector>

#include "glint/math/half.h"

namespace glint::bake {
namespace {

constexpr int kCodes = 256;
/// Images with fewer different codes, such as masks, may lie on a grid by chance. Grids with steps that are powers of two need
/// more codes: heights that somebody drew by hand often lie on them.
constexpr int kFewestCodes = 8, kFewestOfPowers = 24;
/// Floats that were computed from codes are off by a few roundings: by at most this part of a code.
constexpr float kFloatRounding = 1e-3f;
/// Halves are off by at most this part of their value: half a unit in the last of 11 bits.
constexpr float kHalfRounding = 1.0f / 2048;
/// Photoshop keeps 16 bits as 0 .. 32768. Codes that went through it are off by at most this much.
constexpr float kScalingRounding = 2;

/// The numbers origin + k step, k = 0 .. 255. A value lies on the grid if it is off by at most absolute + relative * |value|.
struct Grid {
  float step, origin;
  int fewest = kFewestCodes;  // different codes that an image must have
  float absolute = 0, relative = 0;
};

std::vector<Grid> candidatesOf16Bits() {
  return {
      {257, 0, kFewestCodes, kScalingRounding}, {256, 0, kFewestOfPowers}, {128, 0, kFewestOfPowers}, {1, 0, kFewestOfPowers}};
}

/// @param normals  whether values are components of vectors, which may have a sign
/// @param half     whether all values are halves
/// @param step     step of the integers that the floats were computed from; 0: unknown
std::vector<Grid> candidatesOfFloats(bool normals, bool half, float step) {
  std::vector<Grid> grids = {{1 / 255.0f, 0}};
  if (normals) {
    grids.insert(grids.end(), {{2 / 255.0f, -1},
                               {1 / 127.0f, -1},
                               {1 / 127.0f, -128 / 127.0f},
                               {1 / 128.0f, -1, kFewestOfPowers},
                               {1 / 256.0f, 0, kFewestOfPowers}});
  }
  for (Grid& grid : grids) {
    grid.absolute = kFloatRounding * grid.step + 0.51f * step;
    grid.relative = half ? kHalfRounding : 0;
  }
  return grids;
}

/// Whether all finite values lie on a grid, and on enough different numbers of it.
template <class T>
bool liesOn(const Grid& grid, const PixelArray& image, std::span<const T> pixels, std::span<const int> channels) {
  std::array<bool, kCodes> seen{};
  for (std::size_t k = 0; k < pixels.size(); k += static_cast<std::size_t>(image.channels)) {
    for (const int channel : channels) {
      const auto value = static_cast<float>(pixels[k + static_cast<std::size_t>(channel)]);
      if (!std::isfinite(value)) continue;
      const float code = std::round((value - grid.origin) / grid.step);
      if (!(code >= 0 && code < kCodes)) return false;
      const float error = std::abs(value - (grid.origin + code * grid.step));
      if (error > grid.absolute + grid.relative * std::abs(value)) return false;
      seen[static_cast<std::size_t>(code)] = true;
    }
  }
  return std::count(seen.begin(), seen.end(), true) >= grid.fewest;
}

bool isHalf(std::span<const float> pixels) {
  return std::all_of(pixels.begin(), pixels.end(),
                     [](float v) { return !std::isfinite(v) || halfToFloat(floatToHalf(v)) == v; });
}

/// Whether two numbers are the same but for rounding to float, or to a text of six digits.
bool areClose(double a, double b) {
  if (std::isinf(a) || std::isinf(b)) return a == b;
  return std::abs(a - b) <= 5e-6 * std::abs(b);
}

/// Whether a number is a usual marker of missing data.
bool isSentinel(double number) {
  constexpr double kHuge = 1e30;  // -3.4e38, 1.7e308, ...: no height
  static constexpr std::array kUsual = {-999.0,       -9999.0,  -10000.0, -99999.0,      9999.0,        99999.0,
                                        -32767.0,     -32768.0, 32767.0,  -2147483647.0, -2147483648.0, 2147483647.0,
                                        4294967295.0, -1e10,    -1e20,    1e20};
  return std::abs(number) >= kHuge || std::any_of(kUsual.begin(), kUsual.end(), [&](double u) { return areClose(number, u); });
}

/// Whether a number is so far from all other numbers that it must mean something else.
/// @param gap    distance to the nearest other number
/// @param range  difference of the largest and the smallest other number
bool standsAlone(double number, double gap, double range) {
  constexpr double kFewDigits = 99, kManyRanges = 100;
  return gap > range && (isSentinel(number) || (std::abs(number) >= kFewDigits && range > 0 && gap > kManyRanges * range));
}

/// The lowest and the highest of some values, and the values next to these.
struct Extremes {
  double lowest = std::numeric_limits<double>::infinity(), second_lowest = lowest;
  double highest = -lowest, second_highest = -lowest;

  void add(double v) {
    if (v < lowest) second_lowest = std::exchange(lowest, v);
    if (v > lowest && v < second_lowest) second_lowest = v;
    if (v > highest) second_highest = std::exchange(highest, v);
    if (v < highest && v > second_highest) second_highest = v;
  }
};

}  // namespace

PixelCodes findCodes(const PixelArray& image, std::span<const int> channels) {
  if (std::holds_alternative<std::span<const std::uint8_t>>(image.pixels)) return {1, true};
  if (image.step >= 1 / 255.0f) return {image.step, true};
  const auto find = [&](auto pixels, const std::vector<Grid>& grids, float otherwise) -> PixelCodes {
    for (const Grid& grid : grids)
      if (liesOn(grid, image, pixels, channels)) return {grid.step, true};
    return {otherwise, false};
  };
  if (const auto* codes = std::get_if<std::span<const std::uint16_t>>(&image.pixels))
    return find(*codes, candidatesOf16Bits(), 1);
  const auto floats = std::get<std::span<const float>>(image.pixels);
  const bool half = image.step == 0 && isHalf(floats);
  return find(floats, candidatesOfFloats(channels.size() > 1, half, image.step), image.step);
}

NoDataTest::NoDataTest(const PixelArray& image, std::optional<double> number) : used_(number.has_value()) {
  number_ = number.value_or(0);
  if (image.inverted) number_ = image.code_scale - number_;
  if (std::holds_alternative<std::span<const float>>(image.pixels)) scale_ = image.code_scale;
}

bool NoDataTest::operator()(float value) const {
  if (!used_) return false;
  if (std::isnan(number_)) return std::isnan(value);
  // A number beyond the largest float became infinite when pixels became floats.
  if (std::isinf(value)) return std::abs(number_) > std::numeric_limits<float>::max() && (value < 0) == (number_ < 0);
  return areClose(scale_ * value, number_);
}

std::optional<double> findSentinel(const PixelArray& image, const NoDataTest& known) {
  const auto* pixels = std::get_if<std::span<const float>>(&image.pixels);
  if (!pixels) return {};  // unsigned codes of 8 and 16 bits have no usual marker
  Extremes e;
  for (std::size_t k = 0; k < pixels->size(); k += static_cast<std::size_t>(image.channels))
    if (std::isfinite((*pixels)[k]) && !known((*pixels)[k])) e.add(image.code_scale * (*pixels)[k]);
  if (!(e.lowest < e.highest)) return {};
  if (standsAlone(e.lowest, e.second_lowest - e.lowest, e.highest - e.second_lowest)) return e.lowest;
  if (standsAlone(e.highest, e.highest - e.second_highest, e.second_highest - e.lowest)) return e.highest;
  return {};
}

}  // namespace glint::bake
