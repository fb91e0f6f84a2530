#pragma once

#include <string>
#include <vector>

#include "common/ndf_models.h"
#include "common/tool.h"
#include "glint/query/light/sh_light_query.h"
#include "glint/query/light/sh_transfer.h"

namespace glint::apps {

/// Mix-in: light that a footprint reflects, from a table of glint-shlobes (--light and what belongs to it).
class LightCommand {
 public:
  explicit LightCommand(Tool& tool);

  /// Whether --light was given.
  bool asked() const { return !path_.empty(); }

  /// Integrates the light against the asset's normals and prints the result. Facets are as rough as the asset says, or --lobes.
  /// @param wo  outgoing direction, unit vector above the surface
  /// @throws Error unsupported if the model cannot list the normals of a footprint, or they are not facets
  void run(const NdfAsset& asset, const Footprint& footprint, Vec3 wo);

 private:
  /// The roughness lobe of the facets.
  struct Lobe {
    std::vector<float> zonal;
    float sigma_r;
  };

  void check() const;
  Lobe lobe(const NdfAsset& asset, int order) const;
  /// F G / (4 cos) towards wo.
  Rgb transfer(const NdfAsset& asset, float sigma_r, Vec3 wo) const;
  void report(const ShLightIntegral& integral, Rgb transfer);

  Tool& tool_;
  std::string path_, lobes_path_;
  std::vector<float> fresnel_ = {1, 1, 1}, eta_, k_;
  float shadowing_ = 1, ior_ = 0;
  bool smith_ = false;
  ShLightOptions options_;
};

}  // namespace glint::apps
