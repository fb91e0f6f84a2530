#pragma once

#include <cstdint>
#include <nlohmann/json_fwd.hpp>
#include <string_view>
#include <vector>

#include "glint/api/any_ndf.h"
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

/// The exact picture of a surface.
class LitTruth {
 public:
  /// @param truth  of the map
  LitTruth(const NormalMap& map, const NormalSearch& truth, lit::Shape shape, float sigma_texels, int size);

  lit::Shape shape() const { return shape_; }
  float sigmaTexels() const { return sigma_texels_; }
  /// Radiance that one in fifty pixels of the surface exceeds.
  double brightRadiance() const;
  /// Radiance that the screen shows as white.
  void setWhite(double radiance) { white_ = radiance; }

  /// {scene, sigma_texels, pixels, white, picture}
  nlohmann::json json() const;
  /// The picture of a model, for the same questions: {scene, sigma_texels, as_asked, rmse, flip, picture}. RMSE is of radiance, over that
  /// of the truth.
  nlohmann::json errorsOf(const api::OpenedNdf& ndf) const;

 private:
  std::vector<float> shown(const std::vector<float>& radiance) const;

  lit::Shape shape_;
  float sigma_texels_;
  int size_;
  double white_ = 1;
  std::vector<LitPixel> pixels_;
  std::vector<float> radiance_;
};

/// The exact pictures of a map, of a plane and a sphere at each size. A scene has the same white at all sizes: the
/// bright radiance of its picture from furthest away, in which texels are averaged.
std::vector<LitTruth> litTruths(const NormalMap& map, const std::vector<float>& sizes, int pixels);

}  // namespace glint::apps
