#pragma once

#include <optional>
#include <string>
#include <vector>

#include "common/tool.h"
#include "glint/query/brdf/displaced_brdf.h"

namespace glint::apps {

/// Where a displacement asset is asked: a point, and the levels that a footprint or --level chooses.
struct DisplacedPoint {
  Vec2 uv;
  LevelBlend levels;
};

/// Mix-in: what only displacement assets answer: the light that they reflect from --wi to --wo.
class ReflectanceCommand {
 public:
  explicit ReflectanceCommand(Tool& tool);

  /// Whether one of --wi, --level and --variant was given.
  bool asked() const { return wi_option_->given() || level_option_->given() || variant_option_->given(); }
  bool lightGiven() const { return wi_option_->given(); }
  bool levelGiven() const { return level_option_->given(); }

  /// @param sigma  deviation of the footprint, texels; taken where there is no --level
  /// @throws Error usage if the asset has no such level
  DisplacedPoint point(const Displacement& asset, Vec2 uv, float sigma) const;

  /// Prints the light reflected from --wi to --wo, BRDF times cosine; and with `repeats` the time of it.
  void reflect(const DisplacedBrdf& brdf, const DisplacedPoint& at, Vec3 wo, int repeats) const;

  /// Prints the density of the lobes' normals towards a half vector; and with `repeats` the time of it.
  void density(const DisplacedBrdf& brdf, const DisplacedPoint& at, Vec2 half, int repeats) const;

  /// Light directions drawn for a view, as a table with the columns wix, wiy, wiz and pdf.
  std::string samples(const DisplacedBrdf& brdf, const DisplacedPoint& at, Vec3 wo, int count) const;

  /// A table with the columns u, v; sigma or level; wix, wiy, wiz, wox, woy, woz (answered by reflected, or reflected_r, _g,
  /// _b) or hx, hy (answered by density). @throws Error invalid_input that names the row and the column
  std::string table(const DisplacedBrdf& brdf, const std::string& path) const;

 private:
  Tool& tool_;
  std::vector<float> wi_;
  int level_ = 0;
  DisplacedVariant variant_ = DisplacedVariant::full;
  Option *wi_option_, *level_option_, *variant_option_;
};

/// Densities of the lobes' normals at the pixels of [-1, 1]^2, [size][size], bottom row first. Lobes narrower than a pixel are
/// widened to it.
std::vector<float> lobeImage(const DisplacedBrdf& brdf, const DisplacedPoint& at, int size);

/// A direction of any length above 0 as a unit vector.
/// @throws Error usage if it has none
Vec3 directionOf(const std::vector<float>& xyz, const char* option);

}  // namespace glint::apps
