#pragma once

#include <string>
#include <vector>

#include "common/ndf_models.h"
#include "common/tool.h"
#include "glint/query/sh_light_query.h"

namespace glint::apps {

/// Mix-in: light that a footprint reflects, from a table of glint-shlobes (--light and what belongs to it).
class LightQuery {
 public:
  explicit LightQuery(Tool& tool);

  /// Whether --light was given.
  bool asked() const { return !path_.empty(); }

  /// Integrates the light against the asset's normals and prints the result.
  /// @param wo    outgoing direction, unit vector above the surface
  /// @param info  its roughness is that of the facets, unless --lobes says it
  /// @throws Error unsupported if the model cannot list the normals of a footprint, or they are not facets
  void run(const AnyNdf& model, const api::NdfInfo& info, const Footprint& footprint, Vec3 wo);

 private:
  void check() const;

  Tool& tool_;
  std::string path_, lobes_path_;
  std::vector<float> fresnel_ = {1, 1, 1};
  float shadowing_ = 1;
  ShLightOptions options_;
};

}  // namespace glint::apps
