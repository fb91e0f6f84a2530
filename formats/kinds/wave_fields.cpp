#include "glint/formats/kinds/wave_fields.h"

#include <algorithm>
#include <cmath>
#include <string>

namespace glint::formats {
namespace {

constexpr Range kWavelengths = {0.01, 10};  // um
constexpr float kMostWeight = 100;          // of a channel in red, green or blue: far beyond the largest, 3.2
constexpr double kWhiteTolerance = 1e-3;

bool isUsable(Rgb c) { return std::abs(c.r) <= kMostWeight && std::abs(c.g) <= kMostWeight && std::abs(c.b) <= kMostWeight; }

void checkColours(std::span<const Rgb> channel_rgb, Findings& findings) {
  double sums[3] = {};
  bool usable = true;
  for (const Rgb& c : channel_rgb) {
    usable = usable && isUsable(c);
    sums[0] += c.r, sums[1] += c.g, sums[2] += c.b;
  }
  const auto isWhite = [](double sum) { return std::abs(sum - 1) <= kWhiteTolerance; };
  if (!usable || !std::all_of(sums, sums + 3, isWhite))
    findings.add("wave.colours", "/channel_rgb", "does not sum to white, or has numbers beyond 100");
}

}  // namespace

void checkChannels(WaveChannels meaning, int channels, std::span<const float> wavelengths_um, std::span<const Rgb> channel_rgb,
                   Findings& findings) {
  const std::size_t count = wavelengths_um.size();
  const std::size_t needed = meaning == WaveChannels::xyz ? 3 : count;
  if (count < 1 || count > kMostWaveChannels || static_cast<std::size_t>(channels) != needed)
    findings.add("wave.channels", "/@channels",
                 "is " + std::to_string(channels) + " with " + std::to_string(count) + " wavelengths");
  for (std::size_t k = 0; k < count; ++k) {
    const float here = wavelengths_um[k];
    const bool rises = k == 0 || wavelengths_um[k - 1] < here;
    if (rises && here >= static_cast<float>(kWavelengths.minimum) && here <= static_cast<float>(kWavelengths.maximum)) continue;
    findings.add("wave.wavelengths", "/wavelengths_um", "does not rise within 0.01 to 10 at element " + std::to_string(k));
    break;
  }
  checkColours(channel_rgb, findings);
}

}  // namespace glint::formats
