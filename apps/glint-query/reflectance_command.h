#pragma once

#include <string>
#include <vector>

#include "common/files.h"
#include "common/tool.h"
#include "glint-query/output_options.h"
#include "glint/query/brdf/displaced_brdf.h"

namespace glint::apps {

/// A point of a displacement, and the levels that a footprint or --level chooses there.
struct DisplacedPoint {
  Vec2 uv;
  LevelBlend levels;
};

/// Mix-in: the point that is asked, as --uv and one of --sigma and --level.
class DisplacedPointOptions {
 public:
  explicit DisplacedPointOptions(Tool& tool);

  /// --uv, for its constraints.
  Option& centreOption() { return *uv_option_; }
  bool given() const { return uv_option_->given(); }
  /// Checks that there is a footprint or a level. @throws Error usage
  void checkSize() const;

  /// @throws Error usage if the asset has no such level
  DisplacedPoint point(const DisplacedBrdf& brdf) const;

 private:
  std::vector<double> uv_;
  float sigma_ = 0;
  int level_ = 0;
  Option *uv_option_, *sigma_option_, *level_option_;
};

/// `glint-query reflectance ASSET`: how a displacement reflects light, and how its normals are distributed.
class ReflectanceCommand {
 public:
  explicit ReflectanceCommand(Tool& tool);
  void run();

 private:
  void check() const;

  /// Prints the light reflected from --wi to --wo, BRDF times cosine; with --repeat also the time of the query.
  void reflect(const DisplacedBrdf& brdf, const DisplacedPoint& at) const;

  /// Prints the density of the lobes' normals towards --half; with --repeat also the time of the query.
  void density(const DisplacedBrdf& brdf, const DisplacedPoint& at) const;

  /// Writes light directions drawn for --wo, as a table with the columns wix, wiy, wiz and pdf.
  void writeSamples(const DisplacedBrdf& brdf, const DisplacedPoint& at) const;

  /// Writes a table with the columns u, v; sigma or level; wix, wiy, wiz, wox, woy, woz (answered by reflected, or reflected_r, _g,
  /// _b) or hx, hy (answered by density). @throws Error invalid_input that names the row and the column
  void answerTable(const DisplacedBrdf& brdf) const;

  Tool& tool_;
  InputFile asset_;
  DisplacedPointOptions point_;
  std::vector<float> wi_, wo_, half_;
  DisplacedVariant variant_ = DisplacedVariant::full;
  Option *wi_option_, *wo_option_, *half_option_;
  PictureOptions picture_;
  TableOptions table_;
  int repeat_ = 0;
};

/// Densities of the lobes' normals at the pixels of [-1, 1]^2, [size][size], bottom row first. Lobes narrower than a pixel are
/// widened to it.
std::vector<float> lobeImage(const DisplacedBrdf& brdf, const DisplacedPoint& at, int size);

}  // namespace glint::apps
