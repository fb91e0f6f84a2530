#include "glint-pyramid/wave_options.h"

#include <fmt/format.h>

#include <cmath>
#include <nlohmann/json.hpp>
#include <numbers>
#include <sstream>

#include "common/numbers.h"
#include "glint/bake/wave/colour_weights.h"
#include "glint/formats/asset_writer.h"

namespace glint::apps {
namespace {

/// "8", a number of wavelengths, or "0.45,0.55,0.65", a list of them.
std::vector<float> parseWavelengths(const std::string& text) {
  const auto refuse = [&](const std::string& what) {
    throw Error(
        ErrorCode::usage, "option.range", {}, "--wavelengths", what,
        fmt::format("give a number of wavelengths from 1 to {}, or micrometres such as 0.45,0.55,0.65", kMostWaveChannels));
  };
  if (int count = 0; parseNumber(text, count).empty()) {
    if (count < 1 || count > kMostWaveChannels) refuse(fmt::format("{} wavelengths", count));
    return bake::evenWavelengths(count);
  }
  std::vector<float> wavelengths;
  std::istringstream parts(text);
  for (std::string part; std::getline(parts, part, ',');) {
    float value = 0;
    if (!parseNumber(part, value).empty()) refuse("'" + part + "' is not a wavelength");
    wavelengths.push_back(value);
  }
  return wavelengths;
}

const HeightMap& heightsOf(const formats::Asset& asset, const std::string& path) {
  if (const auto* heights = std::get_if<HeightMap>(&asset.any())) return *heights;
  if (asset.kind() == "normals")
    throw Error(
        ErrorCode::unsupported, "format.kind", path, "", "is of kind normals, and the phase of light needs heights",
        "ingest the height image with glint-ingest --kind height --to heights --texel-size-um; normals alone do not say "
        "them, since a normal map of a scan or a painter need not be that of any surface");
  throw Error(ErrorCode::unsupported, "format.kind", path, "", "is of kind " + std::string(asset.kind()) + ", not heights",
              "give heights, from glint-ingest --kind height --to heights");
}

void warnAbout(Tool& tool, const HeightMap& map, const bake::WaveOptions& values, const std::string& path) {
  const float shortest = values.wavelengths_um.front();
  if (map.texel_size_um > shortest)
    tool.warn(
        fmt::format("{}: texels of {:g} um are wider than the wavelength of {:g} um: heights between them are a smooth curve, "
                    "so light that "
                    "finer detail would diffract beyond |psi| = {:.2g} is missing",
                    path, map.texel_size_um, shortest, shortest / (4 * map.texel_size_um)));
  if (values.wavelengths_um.size() == 1)
    tool.warn("one wavelength is laser light: speckle that the wavelengths of white light would average stays in the images");
  const float footprint_um = kFootprintPerStride * values.stride * map.texel_size_um;
  if (footprint_um < values.coherence_um)
    tool.warn(fmt::format(
        "footprints of the finest level, {:.3g} um, are below the coherence area of {:g} um, so they see up to {:.3g} um; "
        "give --stride {:.0f} for the same at less cost",
        footprint_um, values.coherence_um, std::hypot(footprint_um, values.coherence_um / std::numbers::sqrt2_v<float>),
        std::ceil(values.coherence_um / (kFootprintPerStride * map.texel_size_um))));
}

/// Builds the pyramid, and warns before that takes time; errors of the heights name their file.
bake::WavePyramidData build(Tool& tool, const HeightMap& map, const bake::WaveOptions& values, const std::string& path) {
  try {
    bake::checkWaveOptions(map, values);
    tool.requireMemory(bake::wavePyramidBytes(map, values, static_cast<double>(tool.maxMemory())), "the NDF images",
                       "give a larger --stride, a smaller --resolution or --overlap, or fewer --wavelengths with --spectral");
    warnAbout(tool, map, values, path);
    const bake::ProgressFn progress = tool.progress("images");
    return bake::buildWavePyramid(map, values, progress);
  } catch (const Error& error) {
    if (error.code() == ErrorCode::usage || !error.path().empty()) throw;
    throw Error(error.code(), error.rule(), path, error.object(), error.clause(), error.remedy());
  }
}

nlohmann::json waveJson(const bake::WavePyramidData& pyramid) {
  nlohmann::json json = pyramidJson(pyramid.grey);
  std::size_t bytes = 0;
  for (std::size_t l = 0; l < pyramid.grey.levels.size(); ++l) {
    auto& level = json["levels"][l];
    const std::size_t level_bytes =
        level["size_bytes"].get<std::size_t>() * (1 + static_cast<std::size_t>(pyramid.shape.channels));
    level["size_bytes"] = level_bytes;
    bytes += level_bytes;
  }
  json["size_bytes"] = bytes;
  json["channels"] = pyramid.shape.channels;
  json["wavelengths_um"] = pyramid.wavelengths_um;
  json["coherence_um"] = pyramid.shape.coherence_um;
  json["steepest_slope"] = pyramid.report.steepest_slope;
  json["finest_step_um"] = pyramid.report.finest_step_um;
  json["kernel_columns"] = pyramid.report.kernel_columns;
  json["kernel_rows"] = pyramid.report.kernel_rows;
  return json;
}

std::string waveText(const bake::WavePyramidData& pyramid) {
  const nlohmann::json json = waveJson(pyramid);
  return pyramidText(pyramid.grey) +
         fmt::format("with {} channels {:.2f} MB; heights sampled every {:.3g} um for slopes up to {:.3g}\n",
                     pyramid.shape.channels, 1e-6 * json["size_bytes"].get<double>(), pyramid.report.finest_step_um,
                     pyramid.report.steepest_slope);
}

}  // namespace

WaveOptions::WaveOptions(Tool& tool, const PyramidOptions& pyramid) : pyramid_(pyramid) {
  tool.section("Wave optics");
  tool.choice("--optics", optics_, {{"geometric", Optics::geometric}, {"wave", Optics::wave}},
              "facets are mirrors (geometric), or the surface diffracts light (wave), in colour");
  const Option& coherence =
      tool.option("--coherence-um", values_.coherence_um, "deviation of the area in which light interferes, micrometres")
          .range(0.1, 1e4);
  const Option& wavelengths = tool.option("--wavelengths", wavelengths_,
                                          "a number of wavelengths over the visible range, or a list of them in micrometres");
  const Option& spectral =
      tool.flag("--spectral", values_.spectral, "a channel for each wavelength, for spectral renderers, instead of a colour");
  tool.section(Tool::kOptions);
  tool.addCheck([this, &coherence, &wavelengths, &spectral] {
    if (optics_ == Optics::wave) {
      const std::string other = pyramid_.geometricOption();
      if (!other.empty())
        throw Error(ErrorCode::usage, "cli.usage", {}, other, "has no meaning under wave optics",
                    "leave it out: the coherence area is the roughness, and heights are smooth and repeat");
      static_cast<void>(parseWavelengths(wavelengths_));
    } else if (coherence.given() || wavelengths.given() || spectral.given()) {
      throw Error(ErrorCode::usage, "cli.usage", {},
                  coherence.given()     ? "--coherence-um"
                  : wavelengths.given() ? "--wavelengths"
                                        : "--spectral",
                  "has no meaning under geometric optics", "add --optics wave");
    }
  });
}

bake::WaveOptions WaveOptions::values() const {
  const bake::PyramidOptions shared = pyramid_.values();
  bake::WaveOptions options = values_;
  options.wavelengths_um = parseWavelengths(wavelengths_);
  options.stride = shared.stride;
  options.overlap = shared.overlap;
  options.levels = shared.levels;
  options.precision = shared.precision;
  options.resolution = shared.resolution;
  if (pyramid_.autoResolution())
    options.resolution = bake::resolutionFor(
        static_cast<float>(bake::spotDeviation(double{options.wavelengths_um.front()}, double{options.coherence_um})));
  return options;
}

void makeWavePyramid(Tool& tool, const formats::Asset& asset, const InputFile& input, const WaveOptions& options,
                     const formats::Provenance& provenance, const OutputFile& output) {
  const HeightMap& map = heightsOf(asset, input.path());
  const bake::WaveOptions values = options.values();
  const bake::WavePyramidData pyramid = build(tool, map, values, input.path());
  formats::writeAsset(output.path(), pyramid.view(), provenance, output.writeOptions());
  tool.setResult(waveJson(pyramid));
  tool.summary(waveText(pyramid));
}

}  // namespace glint::apps
