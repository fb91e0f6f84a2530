#pragma once

#include <string>
#include <vector>

#include "common/tool.h"
#include "glint/model/footprint.h"

namespace glint::apps {

/// Mix-in: the footprint that is asked, as --uv and one of --sigma, --cov and --box.
class FootprintOptions {
 public:
  explicit FootprintOptions(Tool& tool);

  /// --uv, for its constraints.
  Option& centreOption() { return *uv_option_; }
  bool given() const { return uv_option_->given(); }

  /// Checks that the footprint has a size, and that it can be asked for.
  /// @throws Error usage
  void check() const;

  Footprint footprint() const;
  /// Its centre as it was given: on a plane without end the whole part counts.
  double u() const { return uv_[0]; }
  double v() const { return uv_[1]; }

 private:
  std::vector<double> uv_;
  std::vector<float> covariance_, box_;
  float sigma_ = 0;
  Option *uv_option_, *sigma_option_, *covariance_option_, *box_option_;
};

}  // namespace glint::apps
