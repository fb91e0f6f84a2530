#include "glint-moments/texture_output.h"

#include <fmt/format.h>

#include <array>
#include <filesystem>
#include <nlohmann/json.hpp>
#include <numbers>

#include "common/files.h"
#include "common/image_formats.h"
#include "common/image_io.h"
#include "glint-moments/moments_options.h"
#include "glint/formats/atomic_file.h"
#include "glint/model/counted.h"

namespace glint::apps {
namespace {

namespace fs = std::filesystem;

constexpr const char* kLeanName = "lean.exr";

std::vector<std::string_view> namesOf(bake::LobeConvention convention) {
  std::vector<std::string_view> names;
  for (const bake::LobeTexture& texture : bake::lobeTextures({}, convention)) names.push_back(texture.name);
  return names;
}

void writeLean(const std::string& path, const SlopeMoments& moments, const std::vector<std::vector<float>>& heights) {
  static const std::array<std::string, 6> kChannels = {"b0_h", "b1_dhds", "b2_dhdt", "b3_dhds2", "b4_dhdt2", "b5_dh2dsdt"};
  std::vector<MipLevel> levels;
  for (int l = 0; l < moments.level_count; ++l) {
    const SlopeMomentsLevel& level = moments.levels[l];
    const std::span<const float> of_level = heights.empty() ? std::span<const float>() : heights[static_cast<std::size_t>(l)];
    levels.push_back({level.columns, level.rows, bake::leanChannels(level.texels, of_level)});
  }
  const auto bytes =
      imageFormats().encodeTexture(path, kChannels, levels, PixelFormat::f32, moments.boundary == Boundary::wrap);
  formats::writeFile(path, std::as_bytes(std::span(bytes)));
}

}  // namespace

TextureOutput::TextureOutput(Tool& tool) {
  const Option& textures = tool.option(
      "--textures", folder_,
      "folder for textures: lean.exr, the moments with all levels as maketx --bumpslopes has them; and normal_LL.png, "
      "roughness_LL.png, ... of every level LL, for toktx, ktx create or maketx --mipimage");
  using bake::LobeConvention;
  tool.choice(
          "--lobe", convention_,
          {{"isotropic", LobeConvention::isotropic}, {"gltf", LobeConvention::gltf}, {"materialx", LobeConvention::materialx}},
          "which textures say how rough a texel is. isotropic: roughness; gltf: roughness and anisotropy as "
          "KHR_materials_anisotropy has them; materialx: roughness, anisotropy and rotation")
      .needs(textures);
  tool.option("--bits", bits_, "of a channel of the textures: 8 or 16").range(8, 16).needs(textures);
  tool.addCheck([this, &tool] {
    if (wanted()) tool.makesMore();
    if (bits_ != 8 && bits_ != 16)
      throw Error(ErrorCode::usage, "image.bits", {}, "--bits", std::to_string(bits_) + " is neither 8 nor 16", "give 8 or 16");
  });
}

std::string TextureOutput::fileOf(std::string_view texture, int level) const {
  return (fs::path(folder_) / fmt::format("{}_{:02}.png", texture, level)).string();
}

void TextureOutput::check(Tool& tool, int levels) const {
  std::vector<std::string> files = {(fs::path(folder_) / kLeanName).string()};
  for (const std::string_view name : namesOf(convention_))
    for (int l = 0; l < levels; ++l) files.push_back(fileOf(name, l));
  for (const std::string& file : files) {
    checkOutput(tool, file, OutputFormat::image);
    checkApart(tool, file, tool.outputPaths().size());
    tool.addOutput(file);
  }
}

std::size_t TextureOutput::write(const SlopeMoments& lean, const std::vector<std::vector<float>>& heights,
                                 const SlopeMoments& lobes) const {
  writeLean((fs::path(folder_) / kLeanName).string(), lean, heights);
  std::size_t limited = 0;
  for (int l = 0; l < lobes.level_count; ++l) {
    const SlopeMomentsLevel& level = lobes.levels[l];
    for (const MapSlopes& s : level.texels) limited += bake::isLimited(s.covariance, convention_) ? 1 : 0;
    for (const bake::LobeTexture& texture : bake::lobeTextures(level.texels, convention_))
      writeImage(fileOf(texture.name, l), level.columns, level.rows, texture.channels, texture.pixels,
                 bits_ == 16 ? PixelFormat::u16 : PixelFormat::u8);
  }
  return limited;
}

namespace {

/// Errors of the lobes of a map, whose normals follow from heights where it has none.
std::vector<bake::LobeError> errorsOf(Tool& tool, const formats::Asset& asset, const SlopeMoments& moments,
                                      const bake::SlopeMomentsOptions& options, float alpha) {
  const auto errors = [&](const NormalMap& map) {
    return bake::lobeErrors(map, moments, alpha / std::numbers::sqrt2_v<float>, tool.progress("errors"));
  };
  if (asset.kind() == "normals") return errors(asset.get<NormalMap>());
  const HeightMap& heights = asset.get<HeightMap>();
  const std::vector<Vec2> normals =
      bake::normalsFromHeights(heights.width, heights.height, heights.heights, options.boundary, nullptr, options.gradient);
  NormalMap map;
  map.width = heights.width, map.height = heights.height, map.normals = normals;
  return errors(map);
}

}  // namespace

std::vector<bake::LobeError> writeTextures(Tool& tool, const TextureOutput& textures, const formats::Asset& asset,
                                           bake::SlopeMomentsOptions options, float alpha) {
  options.finest_level = 0;
  const bake::SlopeMomentsData lobes = momentsOf(asset, options, tool.progress("textures"));
  options.facet_variances = {};
  const bake::SlopeMomentsData lean = momentsOf(asset, options);
  std::vector<std::vector<float>> heights;
  if (asset.kind() == "heights") heights = bake::meanHeights(asset.get<HeightMap>());
  const std::size_t limited = textures.write(lean.view(), heights, lobes.view());
  if (limited > 0)
    tool.warn(counted(limited, {"texel is", "texels are"}) + " rougher than 1, all levels together: written as 1");
  return errorsOf(tool, asset, lean.view(), options, alpha);
}

nlohmann::json errorsJson(const std::vector<bake::LobeError>& errors) {
  nlohmann::json list = nlohmann::json::array();
  for (std::size_t l = 0; l < errors.size(); ++l)
    list.push_back({{"level", l}, {"variation", errors[l].variation}, {"seen", errors[l].seen}});
  return list;
}

std::string errorsText(const std::vector<bake::LobeError>& errors) {
  std::string text = "level   facets that one lobe turns elsewhere\n";
  for (std::size_t l = 0; l < errors.size(); ++l) text += fmt::format("{:<7} {:.1f} %\n", l, 100 * errors[l].variation);
  return text;
}

}  // namespace glint::apps
