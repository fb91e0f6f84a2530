#pragma once

#include <nlohmann/json_fwd.hpp>
#include <string>
#include <utility>
#include <vector>

#include "common/keep_option.h"
#include "common/tool.h"
#include "glint/bake/pyramid/pyramid.h"

namespace glint::apps {

/// The options of glint-pyramid.
class PyramidOptions {
 public:
  explicit PyramidOptions(Tool& tool);

  /// Valid after parsing. @throws Error usage if --levels or --resolution is neither `auto` nor a number
  bake::PyramidOptions values() const;
  /// The same for a tile of a UDIM set, which ends at its margins. @throws Error usage for --boundary wrap
  bake::PyramidOptions tileValues() const;
  /// Value of --keep-normals.
  KeepNormals keep() const { return keep_; }
  bool keepsNormals() const { return keep_ != KeepNormals::none; }
  /// Refuses --keep-normals for what keeps none.
  /// @param what    "the images of Wang tiles"
  /// @throws Error usage
  void refuseKeeping(const std::string& what, const std::string& remedy) const;
  /// Whether the resolution is to follow from the roughness.
  bool autoResolution() const { return resolution_ == "auto"; }
  /// The first of the options that was given and that only geometric optics has; empty: none.
  std::string geometricOption() const;

 private:
  bake::PyramidOptions values_;
  double finest_ = 0, coarsest_ = 0;
  std::string levels_ = "auto", resolution_ = std::to_string(values_.resolution);
  KeepNormals keep_ = KeepNormals::none;
  const Option* boundary_ = nullptr;
  std::vector<std::pair<std::string, const Option*>> geometric_;
};

/// Levels with their images, stored blocks and bytes.
/// @param region  the part of the images that the arrays hold
nlohmann::json pyramidJson(const bake::NdfPyramidData& pyramid, PyramidRegion region = {});
std::string pyramidText(const bake::NdfPyramidData& pyramid, PyramidRegion region = {});
/// Remedy where the images take too much memory.
inline constexpr const char* kLessMemory = "give a larger --stride, or a smaller --resolution or --overlap";
/// Both as the result of a tool.
void reportPyramid(Tool& tool, const bake::NdfPyramidData& pyramid, PyramidRegion region = {});

}  // namespace glint::apps
