#include "glint-query/reflectance_command.h"

#include <fmt/format.h>
#include <tbb/parallel_for.h>

#include <array>
#include <cmath>
#include <nlohmann/json.hpp>
#include <optional>

#include "common/footprint_rules.h"
#include "glint-query/queries.h"
#include "glint/bake/common/counter_random.h"

namespace glint::apps {
namespace {

constexpr std::array kLevel = {"level"};
constexpr std::array kLight = {"wix", "wiy", "wiz"};
constexpr std::array kView = {"wox", "woy", "woz"};

/// Side of the box with the second moments of a Gaussian.
float diameterOf(float sigma) { return std::sqrt(12.0f) * sigma; }

float blendedDensity(const DisplacedBrdf& brdf, const DisplacedPoint& at, Vec2 half, float least_variance = 0) {
  const float first = brdf.normalDensity(at.levels.first, at.uv, half, least_variance);
  if (at.levels.weight == 0) return first;
  return first + at.levels.weight * (brdf.normalDensity(at.levels.second, at.uv, half, least_variance) - first);
}

/// The channels of an asset.
std::vector<float> channelsOf(const DisplacedBrdf& brdf, Rgb color) {
  return brdf.asset().channels == 1 ? std::vector<float>{color.r} : std::vector<float>{color.r, color.g, color.b};
}

/// What is wrong with a level of detail; nothing if the asset has it.
std::optional<FootprintFault> levelFault(const Displacement& asset, int level) {
  if (level >= 0 && level < asset.level_count) return {};
  return FootprintFault{fmt::format("the asset has no level {}", level), fmt::format("give 0 to {}", asset.level_count - 1)};
}

std::optional<Vec3> unitVector(Vec3 given) {
  const float length = std::sqrt(dot(given, given));
  if (!(length > 0 && std::isfinite(length))) return {};
  return 1 / length * given;
}

constexpr const char* kDirectionRemedy = "give X Y Z, z out of the surface";

/// A direction in columns of a table.
Vec3 directionOf(const CsvTable& table, std::size_t row, const std::array<const char*, 3>& columns) {
  const auto [x, y, z] = table.numbers(columns, row);
  if (const auto unit = unitVector({x, y, z})) return *unit;
  table.fail("csv.direction", row, fmt::format("{} is no direction", fmt::join(columns, ",")), kDirectionRemedy);
}

/// Where a row asks.
DisplacedPoint pointOf(const DisplacedBrdf& brdf, const CsvTable& table, std::size_t row) {
  const auto [u, v] = table.numbers(kCentre, row);
  if (table.has(kSigma)) {
    const auto [sigma] = table.numbers(kSigma, row);
    if (const auto fault = sigmaFault(sigma)) table.fail("csv.footprint", row, "the footprint " + fault->what, fault->remedy);
    return {{u, v}, brdf.levelsFor(diameterOf(sigma))};
  }
  const int level = table.wholeNumber(kLevel[0], row);
  if (const auto fault = levelFault(brdf.asset(), level)) table.fail("query.level", row, fault->what, fault->remedy);
  return {{u, v}, {level, level, 0}};
}

}  // namespace

Vec3 directionOf(const std::vector<float>& xyz, const char* option) {
  if (const auto unit = unitVector({xyz[0], xyz[1], xyz[2]})) return *unit;
  throw Error(ErrorCode::usage, "query.arguments", "", option, "is no direction", kDirectionRemedy);
}

ReflectanceCommand::ReflectanceCommand(Tool& tool) : tool_(tool) {
  tool.section("Reflectance (kind displacement)");
  wi_option_ =
      &tool.option(
               "--wi", wi_,
               "displacement: ask for the light reflected from this direction X Y Z to --wo, BRDF times cosine, z out of the "
               "surface")
           .count(3);
  level_option_ = &tool.option("--level", level_, "displacement: level of detail instead of a footprint, 0 is the finest")
                       .range(0, kMaxDisplacementLevels - 1);
  variant_option_ = &tool.choice(
      "--variant", variant_,
      {{"full", DisplacedVariant::full}, {"lobes", DisplacedVariant::lobes}, {"single", DisplacedVariant::single}},
      "displacement: all of the model, its lobes without shadowing and interreflections, or one Beckmann lobe with Smith's "
      "shadowing");
}

DisplacedPoint ReflectanceCommand::point(const Displacement& asset, Vec2 uv, float sigma) const {
  if (!level_option_->given()) return {uv, DisplacedBrdf(asset).levelsFor(diameterOf(sigma))};
  if (const auto fault = levelFault(asset, level_))
    throw Error(ErrorCode::usage, "query.level", "", "--level", fault->what, fault->remedy);
  return {uv, {level_, level_, 0}};
}

void ReflectanceCommand::reflect(const DisplacedBrdf& brdf, const DisplacedPoint& at, Vec3 wo, int repeats) const {
  const Vec3 wi = directionOf(wi_, "--wi");
  const std::vector<float> value = channelsOf(brdf, brdf.reflected(at.levels, at.uv, wi, wo, variant_));
  nlohmann::json result = {{"reflected", value},
                           {"pdf", brdf.pdf(at.levels, at.uv, wi, wo)},
                           {"levels", {at.levels.first, at.levels.second}},
                           {"level_weight", at.levels.weight}};
  std::string text;
  for (const float channel : value) text += fmt::format("{}{:.9g}", text.empty() ? "" : " ", channel);
  tool_.print(text + "\n");
  if (repeats > 0) {
    const double ns = medianNanoseconds(repeats, [&] { return brdf.reflected(at.levels, at.uv, wi, wo, variant_).g; });
    result["nanoseconds"] = ns;
    tool_.print(fmt::format("{:.1f} ns per query\n", ns));
  }
  tool_.setResult(result);
}

void ReflectanceCommand::density(const DisplacedBrdf& brdf, const DisplacedPoint& at, Vec2 half, int repeats) const {
  const float value = blendedDensity(brdf, at, half);
  nlohmann::json result = {{"density", value}};
  tool_.print(fmt::format("{:.9g}\n", value));
  if (repeats > 0) {
    const double ns = medianNanoseconds(repeats, [&] { return blendedDensity(brdf, at, half); });
    result["nanoseconds"] = ns;
    tool_.print(fmt::format("{:.1f} ns per query\n", ns));
  }
  tool_.setResult(result);
}

std::string ReflectanceCommand::samples(const DisplacedBrdf& brdf, const DisplacedPoint& at, Vec3 wo, int count) const {
  std::string text = "wix,wiy,wiz,pdf\n";
  for (int k = 0; k < count; ++k) {
    const DirectionSample s =
        brdf.sample(at.levels, at.uv, wo, bake::randomPair(tool_.seed(), 0, static_cast<std::uint64_t>(k)));
    text += fmt::format("{:.9g},{:.9g},{:.9g},{:.9g}\n", s.direction.x, s.direction.y, s.direction.z, s.pdf);
  }
  return text;
}

std::string ReflectanceCommand::table(const DisplacedBrdf& brdf, const std::string& path) const {
  const CsvTable table = CsvTable::read(path);
  const bool reflects = table.has(kLight) && table.has(kView);
  if (!table.has(kCentre) || table.has(kSigma) == table.has(kLevel) || reflects == table.has(kHalf))
    throw Error(ErrorCode::invalid_input, "csv.columns", path, "header",
                "the columns " + table.header() + " do not make one query of a displacement",
                "name u,v; sigma or level; wix,wiy,wiz,wox,woy,woz or hx,hy");
  std::vector<std::string> names = {reflects ? "reflected" : "density"};
  if (reflects && brdf.asset().channels == 3) names = {"reflected_r", "reflected_g", "reflected_b"};
  std::vector<float> answers;
  for (std::size_t row = 0; row < table.count(); ++row) {
    const DisplacedPoint at = pointOf(brdf, table, row);
    if (reflects) {
      const Rgb color =
          brdf.reflected(at.levels, at.uv, directionOf(table, row, kLight), directionOf(table, row, kView), variant_);
      for (const float channel : channelsOf(brdf, color)) answers.push_back(channel);
    } else {
      const auto [x, y] = table.numbers(kHalf, row);
      answers.push_back(blendedDensity(brdf, at, {x, y}));
    }
  }
  return table.withColumns(names, answers);
}

std::vector<float> lobeImage(const DisplacedBrdf& brdf, const DisplacedPoint& at, int size) {
  constexpr int kParts = 2;  // samples along a side of a pixel
  std::vector<float> image(static_cast<std::size_t>(size) * static_cast<std::size_t>(size));
  const float step = 2 / static_cast<float>(kParts * size);
  tbb::parallel_for(0, size, [&](int y) {
    for (int x = 0; x < size; ++x) {
      float sum = 0;
      for (int part = 0; part < kParts * kParts; ++part) {
        const Vec2 h = {-1 + step * (static_cast<float>(kParts * x + part % kParts) + 0.5f),
                        -1 + step * (static_cast<float>(kParts * y + part / kParts) + 0.5f)};
        sum += blendedDensity(brdf, at, h, step * step);
      }
      image[static_cast<std::size_t>(y) * static_cast<std::size_t>(size) + static_cast<std::size_t>(x)] =
          sum / (kParts * kParts);
    }
  });
  return image;
}

}  // namespace glint::apps
