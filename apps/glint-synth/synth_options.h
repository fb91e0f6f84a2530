#pragma once

#include <string>

#include "common/tool.h"
#include "glint/bake/synth/synth.h"

namespace glint::apps {

/// The options of glint-synth. Declared with "unset" values; values() replaces those by the defaults of the chosen kind.
class SynthOptions {
 public:
  explicit SynthOptions(Tool& tool);

  /// Complete options. Call after parsing; the `command` record then holds the values that were used.
  /// @throws Error usage for a malformed size
  const bake::SynthOptions& values(Tool& tool);

  /// Size of a texel, um; 0 if it was not given. Valid after parsing.
  float texelSize() const { return texel_size_->given() ? texel_size_um_ : 0; }

 private:
  /// Refuses options that kind flake2d does not know, and options of flake2d for another kind.
  void checkFlake2d() const;

  bake::SynthOptions values_;
  std::string size_ = "512";
  float texel_size_um_ = 0, depth_um_ = 0;
  Option* alpha_;
  Option* gamma_;
  Option* correlation_;
  Option* streak_;
  Option* feature_;
  Option* density_;
  Option* slope_;
  Option* flake_size_uv_;
  Option* roughness_;
  Option* coverage_;
  Option* texel_size_;
  Option* depth_;
};

}  // namespace glint::apps
