#pragma once

#include <string>
#include <vector>

#include "common/tool.h"
#include "glint/model/footprint.h"

namespace glint::apps {

/// Mix-in: the size and shape of the footprint that is asked, as one of --sigma, --cov and --box.
class FootprintSize {
 public:
  explicit FootprintSize(Tool& tool);

  /// Checks that there is a size, and that it can be asked for.
  /// @throws Error usage
  void check() const;

  Footprint at(Vec2 centre_uv) const;

 private:
  std::vector<float> covariance_, box_;
  float sigma_ = 0;
  Option *sigma_option_, *covariance_option_, *box_option_;
};

/// Mix-in: the footprint that is asked, as --uv and its size.
class FootprintOptions {
 public:
  explicit FootprintOptions(Tool& tool);

  /// --uv, for its constraints.
  Option& centreOption() { return *uv_option_; }
  bool given() const { return uv_option_->given(); }

  /// As FootprintSize::check.
  void check() const { size_.check(); }

  Footprint footprint() const;
  /// Its centre as it was given: on a plane without end the whole part counts.
  double u() const { return uv_[0]; }
  double v() const { return uv_[1]; }

 private:
  std::vector<double> uv_;
  Option* uv_option_;
  FootprintSize size_;
};

}  // namespace glint::apps
