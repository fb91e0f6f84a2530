#pragma once

#include <cstdint>
#include <functional>
#include <nlohmann/json_fwd.hpp>
#include <string_view>
#include <vector>

#include "glint/model/footprint.h"
#include "glint/model/normal_map.h"
#include "measure/lit_scene.h"
#include "measure/normal_search.h"

namespace glint::apps {

/// What a pixel of a lit picture asks: its radiance is `response` times the density.
struct LitPixel {
  Footprint footprint;
  Vec2 half;
  float response = 0;  ///< of a microfacet BRDF of mirrors with shadows, under an irradiance of 1; 0: no surface, or no light
};

/// A surface of a map under a distant light, as a camera sees it: the questions of all pixels, top row first.
/// @param shape         quad or sphere
/// @param sigma_texels  deviation of the footprint in the middle of the picture, geometric mean of both axes, texels
/// @param size          of the square picture, pixels
std::vector<LitPixel> litPixels(const NormalMap& map, lit::Shape shape, float sigma_texels, int size);

/// "plane", "sphere"
std::string_view sceneName(lit::Shape shape);

/// Radiance that the screen shows as white: pixels that are brighter have at most a fifth of the light. So highlights are shown, however
/// few pixels they have, and are compared.
/// @param radiance  of all pixels of the exact picture, none below 0
double screenWhite(std::vector<float> radiance);

/// The exact picture of a surface, and its white, which is that of all methods.
class LitTruth {
 public:
  /// Answers the density of a footprint at a half vector. Thread-safe.
  using Density = std::function<float(const Footprint&, Vec2)>;

  /// @param search  answers the exact densities of the map
  LitTruth(const NormalMap& map, const NormalSearch& search, lit::Shape shape, float sigma_texels, int size);

  lit::Shape shape() const { return shape_; }
  float sigmaTexels() const { return sigma_texels_; }
  double white() const { return white_; }
  const std::vector<float>& radiance() const { return radiance_; }

  /// {scene, sigma_texels, pixels, white, black_flip, picture}
  nlohmann::json json() const;
  /// The picture of a method, for the same questions: {scene, sigma_texels, as_asked, rmse, flip, picture}. RMSE is of radiance, over that
  /// of the truth. A picture that takes longer than its budget is given up: {scene, sigma_texels, as_asked, given_up_s}.
  /// @param as_asked  whether the method weighs round footprints as they are
  /// @param budget_s  seconds
  nlohmann::json errorsOf(const Density& density, bool as_asked, double budget_s) const;

 private:
  std::vector<float> shown(const std::vector<float>& radiance) const;

  lit::Shape shape_;
  float sigma_texels_;
  int size_;
  std::vector<LitPixel> pixels_;
  std::vector<float> radiance_;
  double white_;
};

/// The exact pictures of a map, of a plane and a sphere at each size.
std::vector<LitTruth> litTruths(const NormalMap& map, const std::vector<float>& sizes, int pixels);

}  // namespace glint::apps
