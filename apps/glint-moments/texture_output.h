#pragma once

#include <nlohmann/json_fwd.hpp>
#include <string>
#include <vector>

#include "common/tool.h"
#include "glint/bake/moments/lobe_errors.h"
#include "glint/bake/moments/lobe_textures.h"
#include "glint/bake/moments/slope_moments.h"
#include "glint/formats/asset_reader.h"

namespace glint::apps {

/// Mix-in: textures for engines (--textures, --lobe, --bits).
class TextureOutput {
 public:
  explicit TextureOutput(Tool& tool);

  bool wanted() const { return !folder_.empty(); }

  /// Checks the names of all files of a chain of so many levels, before the work.
  /// @throws Error io, usage as checkOutput and checkApart
  void check(Tool& tool, int levels) const;

  /// Writes lean.exr, and the textures of every level as files NAME_LL.png.
  /// @param lean     moments of all levels, without the roughness of the material
  /// @param heights  of all levels, or empty
  /// @param lobes    moments of all levels, with the roughness
  /// @return number of texels of which a roughness was above 1, all levels together
  std::size_t write(const SlopeMoments& lean, const std::vector<std::vector<float>>& heights, const SlopeMoments& lobes) const;

 private:
  std::string fileOf(std::string_view texture, int level) const;

  std::string folder_;
  bake::LobeConvention convention_ = bake::LobeConvention::isotropic;
  int bits_ = 8;
};

/// Writes the textures of a map, and measures by how much their lobes differ from the map.
/// @param options  how the moments of the asset were built
/// @param alpha    of the material, root mean square over the map
/// @return errors of all levels
std::vector<bake::LobeError> writeTextures(Tool& tool, const TextureOutput& textures, const formats::Asset& asset,
                                           bake::SlopeMomentsOptions options, float alpha);

nlohmann::json errorsJson(const std::vector<bake::LobeError>& errors);
std::string errorsText(const std::vector<bake::LobeError>& errors);

}  // namespace glint::apps
