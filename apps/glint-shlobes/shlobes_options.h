#pragma once

#include <nlohmann/json_fwd.hpp>
#include <string>
#include <vector>

#include "common/tool.h"
#include "glint-shlobes/light_file.h"
#include "glint/bake/sh/gaussian_fit.h"
#include "glint/bake/sh/light.h"
#include "glint/bake/sh/lobes.h"

namespace glint::apps {

/// The options of glint-shlobes.
class ShLobesOptions {
 public:
  explicit ShLobesOptions(Tool& tool);

  /// File of the light; empty when lobes are asked for.
  const std::string& light() const { return light_; }
  const AreaLightOptions& areaLights() const { return area_lights_; }
  bake::ShLobesOptions lobesOptions() const;
  bake::ShLightOptions lightOptions() const;
  /// Number of spherical Gaussians that the light is fitted with as well; 0: none.
  int gaussians() const { return gaussians_; }

 private:
  void check(Tool& tool);
  ShGrid grid(ShGrid other) const;

  std::string light_, grid_;
  float sigma_r_ = 0;
  int order_ = 60, band_limit_ = 0, gaussians_ = 0;
  std::uint64_t max_bytes_ = 0;
  ShPrecision precision_ = ShPrecision::f16;
  AreaLightOptions area_lights_;
  Option* sigma_option_;
};

nlohmann::json lobesJson(const ShLobes& lobes);
nlohmann::json lightJson(const ShLight& light);
/// Axes, sharpness and amplitudes of spherical Gaussians that are fitted to an environment, and the error of the fit.
/// @param path  of the light, for errors. Throws Error invalid_input if there is no light
nlohmann::json gaussiansJson(const bake::Environment& environment, const std::string& path, int count);
/// The result of a function above for people, in one line.
std::string tableText(const nlohmann::json& table);

}  // namespace glint::apps
