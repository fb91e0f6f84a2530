#pragma once

#include <nlohmann/json_fwd.hpp>
#include <string>
#include <utility>
#include <vector>

#include "common/tool.h"
#include "glint/bake/moments/slope_moments.h"
#include "glint/formats/asset_reader.h"

namespace glint::apps {

/// The options of glint-moments, but those of textures.
class MomentsOptions {
 public:
  explicit MomentsOptions(Tool& tool);

  /// Options for the moments of an asset. They refer to memory of this object.
  /// @throws Error usage if the map has fewer levels; invalid_input for an image of roughness that does not fit the map
  /// @param of_tile  whether the map is a tile of a UDIM set, which ends at its margins. Then an error usage for --boundary wrap and for
  ///                 an image of roughness
  bake::SlopeMomentsOptions values(int width, int height, bool of_tile = false);
  /// Alpha of the material: root mean square over the map. Valid after values().
  float meanAlpha() const { return mean_alpha_; }

 private:
  void readRoughness();

  Tool& tool_;
  bake::SlopeMomentsOptions values_;
  const Option* finest_option_ = nullptr;
  const Option* boundary_option_ = nullptr;
  std::string roughness_ = "0";
  std::string roughness_path_;  ///< empty: roughness is a number
  double roughness_value_ = 0;
  float mean_alpha_ = 0;
  std::vector<float> facet_variances_;
};

/// Width and height of the map of an asset of kind normals or heights, texels.
/// @throws Error unsupported for other kinds
std::pair<int, int> mapSize(const formats::Asset& asset, const std::string& path);

/// Moments of the map of an asset of kind normals or heights.
bake::SlopeMomentsData momentsOf(const formats::Asset& asset, const bake::SlopeMomentsOptions& options,
                                 const bake::ProgressFn& progress = {});

/// Sizes, bytes and the spread of slopes of every level.
nlohmann::json momentsJson(const bake::SlopeMomentsData& moments);
std::string momentsText(const bake::SlopeMomentsData& moments);

}  // namespace glint::apps
