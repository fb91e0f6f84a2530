#pragma once

#include <vector>

#include "common/ndf_models.h"
#include "common/tool.h"
#include "glint-query/footprint_options.h"
#include "glint-query/output_options.h"
#include "glint-query/queries.h"

namespace glint::apps {

/// Mix-in: half vectors that are asked: --half or --range.
class HalfVectorOptions {
 public:
  explicit HalfVectorOptions(Tool& tool);

  Option& halfOption() { return *half_option_; }
  Option& rangeOption() { return *range_option_; }
  bool given() const { return half_option_->given() || range_option_->given(); }

  Query query(const Footprint& footprint) const;
  /// Value of --spread.
  Vec2 spread() const;
  Option& spreadOption() { return *spread_option_; }

 private:
  void check() const;

  std::vector<float> half_, range_, spread_;
  Option *half_option_, *range_option_, *spread_option_;
};

/// `glint-query ASSET`: a density of a distribution of normals, a mean of it, a table of them, samples, or a picture.
class DistributionCommand {
 public:
  explicit DistributionCommand(Tool& tool);
  void run();

 private:
  void check() const;
  /// @param which  footprints that are smaller than the asset can answer as they are, with a verb
  void warnOfWidening(const std::string& which);
  void answerTable();
  void answerOne();
  /// The colour of a wave-pyramid or wave-cp towards psi.
  void answerColour(const Query& query);
  void writeSamples();
  void writePicture();

  Tool& tool_;
  NdfAsset asset_;
  FootprintOptions footprint_;
  HalfVectorOptions halves_;
  PictureOptions picture_;
  TableOptions table_;
  int repeat_ = 0;
};

}  // namespace glint::apps
