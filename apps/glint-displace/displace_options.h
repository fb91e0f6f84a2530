#pragma once

#include <nlohmann/json_fwd.hpp>
#include <string>
#include <vector>

#include "common/tool.h"
#include "glint-displace/base_images.h"
#include "glint-displace/base_table_file.h"
#include "glint/bake/displace/displace.h"

namespace glint::apps {

/// The options of glint-displace.
class DisplaceOptions {
 public:
  explicit DisplaceOptions(Tool& tool);

  /// Valid after parsing; reads the images and the table of the base.
  /// @throws Error usage if --base or --bounces cannot be read; invalid_input if an image does not fit the map, or the table
  ///         cannot be used
  bake::DisplaceOptions values(const HeightMap& map) const;

 private:
  int factor_ = 16;
  std::vector<int> factors_;
  std::string base_ = "diffuse:0.8";
  BaseImages images_;
  BaseTableFile table_;
  std::string bounces_ = "auto";
  bake::DisplaceOptions values_;
  const Option* factors_given_ = nullptr;
  const Option* base_given_ = nullptr;
};

/// Reads `diffuse:RHO`, `ggx:ALPHA` or `ggx:ALPHA:ETA,K`.
/// @throws Error usage if it is none of these, or an albedo or roughness is out of range
BaseBrdf parseBase(const std::string& text);

/// Refuses work that takes more than --max-memory.
/// @throws Error failed
void requireDisplaceMemory(const Tool& tool, const HeightMap& map, const bake::DisplaceOptions& options);

/// Warns where the model's assumptions do not hold: T S is not R, light hops between cells, or lobes do not fit.
/// @param tolerance  what the scaling may miss, as it was asked; 0: not asked
void warnAbout(Tool& tool, const bake::DisplacementData& data, float tolerance);

/// Levels with their cells, bytes and measures.
nlohmann::json displacementJson(const bake::DisplacementData& data);
std::string displacementText(const bake::DisplacementData& data);

}  // namespace glint::apps
