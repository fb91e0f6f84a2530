#pragma once

#include <string>
#include <vector>

#include "common/ndf_models.h"
#include "common/tool.h"
#include "glint-query/light_command.h"
#include "glint-query/queries.h"
#include "glint-query/reflectance_command.h"

namespace glint::apps {

/// The options of glint-query and what they ask for.
class DistributionCommand {
 public:
  explicit DistributionCommand(Tool& tool);

  /// Answers what was asked of a distribution: one query, a table of them, an image, or the time of a query.
  void run(NdfAsset& asset);

  /// Answers what was asked of a displacement.
  void run(const Displacement& asset);

 private:
  void check() const;
  void checkTable() const;
  void checkTableOutput() const;
  void checkFootprint(const std::string& option) const;
  void checkDisplacement() const;
  Footprint footprint() const;
  Query query() const;
  void answerTable(NdfAsset& asset);
  void answerOne(NdfAsset& asset);
  void writeSamples(NdfAsset& asset);
  void writeTable(const std::string& text);
  void writePicture(NdfAsset& asset);

  Tool& tool_;
  LightCommand light_;
  ReflectanceCommand displacement_;
  std::vector<float> uv_, covariance_, box_, half_, range_, wo_;
  float sigma_ = 0;
  std::string image_, csv_, output_;
  int image_size_ = 0;
  int repeat_ = 0;
  int samples_ = 0;
  Option *wo_option_, *uv_option_, *sigma_option_, *covariance_option_, *box_option_, *half_option_, *range_option_,
      *csv_option_, *output_option_;
};

}  // namespace glint::apps
