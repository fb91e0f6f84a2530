#include "glint/bake/displace/merl_table.h"

#include <fmt/format.h>

#include <algorithm>
#include <bit>
#include <cmath>
#include <cstring>
#include <numbers>
#include <string>

#include "glint/model/counted.h"

namespace glint::bake {
namespace {

constexpr std::size_t kHeader = 3 * sizeof(std::int32_t);
constexpr double kScales[3] = {1 / 1500.0, 1.15 / 1500, 1.66 / 1500};
constexpr const char* kChannels[3] = {"red", "green", "blue"};
constexpr double kMost = 1e6;  // 1 / sr; mirrors of half a milliradian have less
constexpr const char* kRemedy =
    "give a BRDF in MERL's form: numbers of bins (90, 90, 180), then doubles of red, green and blue";

template <class T>
T numberAt(std::span<const std::byte> bytes, std::size_t place) {
  static_assert(std::endian::native == std::endian::little);
  T value;
  std::memcpy(&value, bytes.data() + place, sizeof value);
  return value;
}

[[noreturn]] void refuse(const char* rule, const std::string& object, const std::string& what, const char* remedy = kRemedy) {
  throw Error(ErrorCode::invalid_input, rule, {}, object, what, remedy);
}

/// Name of a bin, as its index in each axis.
std::string binName(const MerlTable& table, std::size_t k) {
  const auto azimuth = static_cast<std::size_t>(table.azimuth_bins),
             difference = static_cast<std::size_t>(table.difference_bins);
  const std::size_t plane = azimuth * difference * static_cast<std::size_t>(table.half_bins);
  return fmt::format("{}, theta_half {}, theta_diff {}, phi_diff {}", kChannels[k / plane], k % plane / (azimuth * difference),
                     k / azimuth % difference, k % azimuth);
}

}  // namespace

void checkMerlSize(std::span<const std::byte> head, std::uint64_t file_bytes) {
  if (head.size() < kHeader)
    refuse("merl.size", {}, counted(file_bytes, {"byte is", "bytes are"}) + " too few for a table of a BRDF");
  std::uint64_t bins = 1;
  std::int32_t sizes[3];
  for (std::size_t k = 0; k < 3; ++k) sizes[k] = numberAt<std::int32_t>(head, k * sizeof(std::int32_t));
  for (const std::int32_t size : sizes) {
    if (size < kLeastMerlBins || size > kMostMerlBins)
      refuse("merl.size", {},
             fmt::format("the first 12 bytes say {} x {} x {} bins, where each has to be {} to {}", sizes[0], sizes[1],
                         sizes[2], kLeastMerlBins, kMostMerlBins));
    bins *= static_cast<std::uint64_t>(size);
  }
  const std::uint64_t wanted = kHeader + 3 * sizeof(double) * bins;
  if (file_bytes != wanted)
    refuse("merl.size", {},
           fmt::format("{} bytes are too {} for {} x {} x {} bins, which take {}", file_bytes,
                       file_bytes < wanted ? "few" : "many", sizes[0], sizes[1], sizes[2], wanted));
}

MerlTable readMerl(std::span<const std::byte> bytes) {
  checkMerlSize(bytes, bytes.size());
  MerlTable table;
  table.half_bins = numberAt<std::int32_t>(bytes, 0);
  table.difference_bins = numberAt<std::int32_t>(bytes, 4);
  table.azimuth_bins = numberAt<std::int32_t>(bytes, 8);
  const std::size_t count = (bytes.size() - kHeader) / sizeof(double), plane = count / 3;
  table.values.resize(count);
  std::size_t bad = 0, first = 0;
  bool lit = false;
  for (std::size_t k = 0; k < count; ++k) {
    const double value = kScales[k / plane] * numberAt<double>(bytes, kHeader + k * sizeof(double));
    if (!(std::abs(value) <= kMost) && bad++ == 0) first = k;
    table.negative += value < 0;
    table.values[k] = static_cast<float>(std::clamp(value, 0.0, kMost));
    lit |= table.values[k] > 0;
  }
  if (bad > 0)
    refuse("merl.values", "bin " + binName(table, first),
           counted(bad, {"value is", "values are"}) + " not finite or above 1e6 / sr",
           "repair the table: bins without a measurement are negative");
  if (!lit) refuse("merl.values", {}, "no value is above 0: nothing is reflected", "give a table with some light in it");
  return table;
}

std::array<float, 3> MerlTable::at(double theta_half, double theta_difference, double phi_difference) const {
  constexpr double kHalfPi = 0.5 * std::numbers::pi;
  struct Axis {
    std::size_t low, high;
    float part;
  };
  const auto clamped = [](double place, int bins) {
    const double at = std::clamp(place - 0.5, 0.0, bins - 1.0);
    const auto low = static_cast<std::size_t>(at);
    return Axis{low, std::min(low + 1, static_cast<std::size_t>(bins) - 1), static_cast<float>(at - std::floor(at))};
  };
  const Axis h = clamped(half_bins * std::sqrt(std::max(0.0, theta_half / kHalfPi)), half_bins);
  const Axis d = clamped(difference_bins * theta_difference / kHalfPi, difference_bins);
  const double turns = phi_difference / std::numbers::pi,
               place = azimuth_bins * (turns - std::floor(turns)) - 0.5 + azimuth_bins;
  const auto bins = static_cast<std::size_t>(azimuth_bins), low = static_cast<std::size_t>(place);
  const Axis a{low % bins, (low + 1) % bins, static_cast<float>(place - std::floor(place))};
  std::array<float, 3> out = {};
  const std::size_t plane = values.size() / 3;
  for (const auto& [i, wi] : {std::pair{h.low, 1 - h.part}, std::pair{h.high, h.part}})
    for (const auto& [j, wj] : {std::pair{d.low, 1 - d.part}, std::pair{d.high, d.part}})
      for (const auto& [k, wk] : {std::pair{a.low, 1 - a.part}, std::pair{a.high, a.part}})
        for (std::size_t c = 0; c < 3; ++c)
          out[c] += wi * wj * wk * values[c * plane + (i * static_cast<std::size_t>(difference_bins) + j) * bins + k];
  return out;
}

}  // namespace glint::bake
