#pragma once

#include <nlohmann/json_fwd.hpp>
#include <string>
#include <vector>

#include "common/tool.h"
#include "glint/bake/tiny/explicit_map.h"
#include "glint/bake/tiny/tiny_example.h"
#include "glint/formats/asset_reader.h"

namespace glint::apps {

/// The options of glint-tiny that make an asset.
class TinyOptions {
 public:
  explicit TinyOptions(Tool& tool);

  /// Options for the builder.
  /// @throws Error as readTransforms
  bake::TinyOptions values();

  /// The example that is cut from a map, as --cut and --at say; the whole map without them.
  /// @throws Error usage if it is not inside the map
  NormalMap example(const NormalMap& map);

  /// Options that another mode of the tool does not take.
  const std::vector<const Option*>& options() const { return options_; }

 private:
  void check() const;

  Tool& tool_;
  bake::TinyOptions values_;
  std::string resolution_ = "128";
  std::string transforms_path_;
  int cut_ = 0;
  std::vector<int> at_ = {0, 0};
  std::vector<const Option*> options_;
  const Option *density_option_ = nullptr, *overlap_option_ = nullptr, *background_option_ = nullptr, *at_option_ = nullptr;
  std::vector<Vec2> normals_;
};

/// The options of glint-tiny that write a part of a plane as a map.
class ExplicitOptions {
 public:
  /// @param others  options that do not go with these
  ExplicitOptions(Tool& tool, const std::vector<const Option*>& others);

  bool wanted() const { return option_->given(); }
  /// @throws Error usage
  bake::PlaneWindow window() const;

 private:
  std::vector<int> size_;
  std::vector<std::string> origin_ = {"0", "0"};
  int per_texel_ = 1;
  const Option* option_;
};

nlohmann::json tinyJson(const bake::TinyExampleData& tiny);
std::string tinyText(const bake::TinyExampleData& tiny);

}  // namespace glint::apps
