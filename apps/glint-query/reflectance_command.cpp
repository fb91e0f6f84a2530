#include "glint-query/reflectance_command.h"

#include <fmt/format.h>
#include <tbb/parallel_for.h>

#include <array>
#include <cmath>
#include <nlohmann/json.hpp>
#include <optional>

#include "common/answer_columns.h"
#include "common/footprint_rules.h"
#include "common/input_asset.h"
#include "glint-query/command_forms.h"
#include "glint-query/directions.h"
#include "glint-query/queries.h"
#include "glint-query/usage.h"
#include "glint/bake/common/counter_random.h"

namespace glint::apps {
namespace {

/// Side of the box with the second moments of a Gaussian.
float diameterOf(float sigma) { return std::sqrt(12.0f) * sigma; }

float blendedDensity(const DisplacedBrdf& brdf, const DisplacedPoint& at, Vec2 half, float least_variance = 0) {
  const float first = brdf.normalDensity(at.levels.first, at.uv, half, least_variance);
  if (at.levels.weight == 0) return first;
  return first + at.levels.weight * (brdf.normalDensity(at.levels.second, at.uv, half, least_variance) - first);
}

/// The channels of a colour that the asset has.
std::vector<float> channelsOf(const DisplacedBrdf& brdf, Rgb color) {
  return brdf.asset().channels == 1 ? std::vector<float>{color.r} : std::vector<float>{color.r, color.g, color.b};
}

/// The fault of a level of detail; nothing if the asset has the level.
std::optional<FootprintFault> levelFault(const Displacement& asset, int level) {
  if (level >= 0 && level < asset.level_count) return {};
  return FootprintFault{fmt::format("the asset has no level {}", level), fmt::format("give 0 to {}", asset.level_count - 1)};
}

bool asksReflection(const CsvTable& table) { return table.has(kLight) && table.has(kView); }

void requireReflectanceColumns(const CsvTable& table) {
  table.requireWhole(kLight);
  table.requireWhole(kView);
  table.requireWhole(kHalf);
  if (!table.has(kCentre) || table.has(kSigma) == table.has(kLevel) || asksReflection(table) == table.has(kHalf))
    throw Error(ErrorCode::invalid_input, "csv.columns", table.path(), "header",
                "the columns " + table.header() + " do not make one query of a displacement",
                "name u,v; sigma or level; wix,wiy,wiz,wox,woy,woz or hx,hy");
}

/// The direction in three columns of a row.
Vec3 directionOf(const CsvTable& table, std::size_t row, const std::array<const char*, 3>& columns) {
  const auto [x, y, z] = table.numbers(columns, row);
  if (const auto unit = unitVector({x, y, z})) return *unit;
  table.fail("csv.direction", row, fmt::format("{} is no direction", fmt::join(columns, ",")), kDirectionRemedy);
}

/// The point that a row asks.
DisplacedPoint pointOf(const DisplacedBrdf& brdf, const CsvTable& table, std::size_t row) {
  const Vec2 uv = table.position(kCentre, row);
  if (table.has(kSigma)) {
    const auto [sigma] = table.numbers(kSigma, row);
    if (const auto fault = sigmaFault(sigma)) table.fail("csv.footprint", row, "the footprint " + fault->what, fault->remedy);
    return {uv, brdf.levelsFor(diameterOf(sigma))};
  }
  const int level = table.wholeNumber(kLevel[0], row);
  if (const auto fault = levelFault(brdf.asset(), level)) table.fail("query.level", row, fault->what, fault->remedy);
  return {uv, {level, level, 0}};
}

}  // namespace

DisplacedPointOptions::DisplacedPointOptions(Tool& tool) {
  uv_option_ = &tool.option("--uv", uv_, "centre of the footprint, texture space").count(2);
  sigma_option_ =
      &tool.option("--sigma", sigma_, "footprint: deviation of an isotropic Gaussian, texels; it chooses the levels")
           .range(kLeastSigma, kMostSigma);
  level_option_ = &tool.option("--level", level_, "level of detail instead of a footprint, 0 is the finest")
                       .range(0, kMaxDisplacementLevels - 1)
                       .excludes(*sigma_option_);
}

void DisplacedPointOptions::checkSize() const {
  if (!sigma_option_->given() && !level_option_->given())
    throwUsage("neither a footprint nor a level was given", "add --sigma S or --level L");
}

DisplacedPoint DisplacedPointOptions::point(const DisplacedBrdf& brdf) const {
  const Vec2 uv = wrappedUv(uv_[0], uv_[1]);
  if (!level_option_->given()) return {uv, brdf.levelsFor(diameterOf(sigma_))};
  if (const auto fault = levelFault(brdf.asset(), level_))
    throw Error(ErrorCode::usage, "query.level", "", "--level", fault->what, fault->remedy);
  return {uv, {level_, level_, 0}};
}

ReflectanceCommand::ReflectanceCommand(Tool& tool)
    : tool_(tool),
      asset_(tool, "asset of kind displacement", "ASSET"),
      point_(tool),
      wi_option_(&tool.option("--wi", wi_,
                              "ask for the light reflected from this direction X Y Z to --wo, BRDF times cosine, z out of the "
                              "surface")
                      .count(3)),
      wo_option_(&tool.option("--wo", wo_, "outgoing direction X Y Z, z out of the surface").count(3)),
      half_option_(
          &tool.option("--half", half_, "ask for the density of the lobes' normals towards a half vector HX HY").count(2)),
      picture_(tool),
      table_(tool, "answer a table of queries; its header names u,v; sigma or level; wix,wiy,wiz,wox,woy,woz or hx,hy",
             "draw directions of light for --wo: a table of wix,wiy,wiz,pdf") {
  tool.choice(
      "--variant", variant_,
      {{"full", DisplacedVariant::full}, {"lobes", DisplacedVariant::lobes}, {"single", DisplacedVariant::single}},
      "all of the model, its lobes without shadowing and interreflections, or one Beckmann lobe with Smith's shadowing");
  tool.option("--repeat", repeat_, "time the query: nanoseconds, median of 15 runs of N / 15").range(1, 1000000000);
  wi_option_->needs(*wo_option_).excludes(*half_option_);
  table_.samplesOption().needs(*wo_option_);
  for (Option* one : {&point_.centreOption(), wi_option_, wo_option_, half_option_, &picture_.option()})
    table_.csvOption().excludes(*one);
  tool.usesSeed();
  for (const CommandForm& form : {kLightForm, kDistributionForm}) tool.pointTo(form.line, form.options);
  tool.addCheck([this] { check(); });
}

void ReflectanceCommand::check() const {
  if (table_.csvGiven()) return;
  if (!point_.given()) throwUsage("no point was given", "add --uv U V, or --csv TABLE");
  point_.checkSize();
  if (!wi_option_->given() && !half_option_->given() && !picture_.given() && table_.samples() == 0)
    throwUsage("nothing was asked", "add --wi and --wo, or --half, --samples or --image");
}

void ReflectanceCommand::run() {
  const formats::Asset opened = openInput(tool_, asset_.path());
  if (opened.kind() != "displacement")
    throw Error(ErrorCode::unsupported, "format.kind", asset_.path(), "",
                "is of kind " + std::string(opened.kind()) + ", which holds no displacement",
                "pass an asset of glint-displace, or ask for the light by " + kLightForm.line);
  const DisplacedBrdf brdf(opened.get<Displacement>());
  if (table_.csvGiven()) return answerTable(brdf);
  const DisplacedPoint at = point_.point(brdf);
  if (picture_.given()) picture_.write(picture_.size(256), lobeImage(brdf, at, picture_.size(256)));
  if (table_.samples() > 0) writeSamples(brdf, at);
  if (wi_option_->given()) reflect(brdf, at);
  if (half_option_->given()) density(brdf, at);
}

void ReflectanceCommand::reflect(const DisplacedBrdf& brdf, const DisplacedPoint& at) const {
  const Vec3 wi = directionOf(wi_, "--wi"), wo = directionOf(wo_, "--wo");
  const std::vector<float> value = channelsOf(brdf, brdf.reflected(at.levels, at.uv, wi, wo, variant_));
  std::string text;
  for (const float channel : value) text += fmt::format("{}{:.9g}", text.empty() ? "" : " ", channel);
  tool_.print(text + "\n");
  reportTimed(tool_,
              {{"reflected", value},
               {"pdf", brdf.pdf(at.levels, at.uv, wi, wo)},
               {"levels", {at.levels.first, at.levels.second}},
               {"level_weight", at.levels.weight}},
              repeat_, [&] { return brdf.reflected(at.levels, at.uv, wi, wo, variant_).g; });
}

void ReflectanceCommand::density(const DisplacedBrdf& brdf, const DisplacedPoint& at) const {
  const Vec2 half = {half_[0], half_[1]};
  const float value = blendedDensity(brdf, at, half);
  tool_.print(fmt::format("{:.9g}\n", value));
  reportTimed(tool_, {{"density", value}}, repeat_, [&] { return blendedDensity(brdf, at, half); });
}

void ReflectanceCommand::writeSamples(const DisplacedBrdf& brdf, const DisplacedPoint& at) const {
  const Vec3 wo = directionOf(wo_, "--wo");
  std::string text = std::string(kLightSamples) + "\n";
  for (int k = 0; k < table_.samples(); ++k) {
    const DirectionSample s =
        brdf.sample(at.levels, at.uv, wo, bake::randomPair(tool_.seed(), 0, static_cast<std::uint64_t>(k)));
    text += fmt::format("{:.9g},{:.9g},{:.9g},{:.9g}\n", s.direction.x, s.direction.y, s.direction.z, s.pdf);
  }
  table_.write(text);
  tool_.setResult({{"samples", table_.samples()}});
}

void ReflectanceCommand::answerTable(const DisplacedBrdf& brdf) const {
  const CsvTable table = CsvTable::read(table_.csv(), requireReflectanceColumns);
  const bool reflects = asksReflection(table);
  std::vector<std::string> names = {reflects ? kReflected : kDensity};
  if (reflects && brdf.asset().channels == 3) names.assign(kReflectedRgb.begin(), kReflectedRgb.end());
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
  table_.write(table.withColumns(names, answers));
  tool_.setResult({{"queries", table.count()}});
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
