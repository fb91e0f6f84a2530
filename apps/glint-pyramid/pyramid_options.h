#pragma once

#include <nlohmann/json_fwd.hpp>
#include <string>

#include "common/tool.h"
#include "glint/bake/pyramid/pyramid.h"

namespace glint::apps {

/// The options of glint-pyramid.
class PyramidCommand {
 public:
  explicit PyramidCommand(Tool& tool);

  /// Valid after parsing. @throws Error usage if --levels is neither `auto` nor a number
  bake::PyramidOptions options() const;

 private:
  bake::PyramidOptions options_;
  std::string levels_ = "auto";
};

/// Levels with their images, stored blocks and bytes.
nlohmann::json pyramidJson(const bake::NdfPyramidData& pyramid);
std::string pyramidText(const bake::NdfPyramidData& pyramid);

}  // namespace glint::apps
