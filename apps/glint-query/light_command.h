#pragma once

#include <string>
#include <vector>

#include "common/ndf_models.h"
#include "common/tool.h"
#include "glint-query/footprint_options.h"
#include "glint/query/light/sh_light_query.h"
#include "glint/query/light/sh_transfer.h"

namespace glint::apps {

/// `glint-query light ASSET`: light that a footprint reflects, by a table of glint-shlobes.
class LightCommand {
 public:
  explicit LightCommand(Tool& tool);

  /// Integrates the light against the asset's normals and prints the result. The roughness of the facets is that of --lobes, or
  /// else of the asset.
  /// @throws Error unsupported if the model cannot list the normals of a footprint
  void run();

 private:
  /// The roughness lobe of the facets.
  struct Lobe {
    std::vector<float> zonal;
    float sigma_r;
  };

  void check() const;
  void addReflectance();
  Lobe lobe(int order) const;
  ShLightIntegral integral(const ShLight& light, const Lobe& lobe, Vec3 wo) const;
  /// The factor F G / (4 cos) towards wo.
  Rgb transfer(float sigma_r, Vec3 wo) const;
  void report(const ShLightIntegral& integral, Rgb transfer);

  Tool& tool_;
  NdfAsset asset_;
  FootprintOptions footprint_;
  std::string path_, lobes_path_;
  std::vector<float> wo_, fresnel_ = {1, 1, 1}, eta_, k_;
  float shadowing_ = 1, ior_ = 0;
  bool smith_ = false;
  ShLightOptions options_;
};

}  // namespace glint::apps
