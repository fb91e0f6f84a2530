#include "glint-query/footprint_options.h"

#include "common/footprint_rules.h"

namespace glint::apps {

FootprintSize::FootprintSize(Tool& tool) {
  sigma_option_ =
      &tool.option("--sigma", sigma_, "footprint: deviation of an isotropic Gaussian, texels").range(kLeastSigma, kMostSigma);
  covariance_option_ = &tool.option("--cov", covariance_, "footprint: covariance SXX SXY SYY of a Gaussian, texels^2").count(3);
  box_option_ = &tool.option("--box", box_, "footprint: half axes AX AY BX BY of a parallelogram, texels").count(4);
  sigma_option_->excludes(*covariance_option_).excludes(*box_option_);
  covariance_option_->excludes(*box_option_);
}

void FootprintSize::check() const {
  if (!sigma_option_->given() && !covariance_option_->given() && !box_option_->given())
    throw Error(ErrorCode::usage, "query.arguments", "", "", "the footprint has no size",
                "add --sigma S, --cov SXX SXY SYY or --box AX AY BX BY");
  if (sigma_option_->given()) return;  // its range was checked
  if (const auto fault = footprintFault(at({})))
    throw Error(ErrorCode::usage, "query.arguments", "", "", (box_option_->given() ? "--box " : "--cov ") + fault->what,
                fault->remedy);
}

Footprint FootprintSize::at(Vec2 centre) const {
  if (covariance_option_->given()) return Footprint::gaussian(centre, {covariance_[0], covariance_[1], covariance_[2]});
  if (box_option_->given()) return Footprint::box(centre, {box_[0], box_[1]}, {box_[2], box_[3]});
  return Footprint::isotropic(centre, sigma_);
}

FootprintOptions::FootprintOptions(Tool& tool)
    : uv_option_(&tool.option("--uv", uv_, "centre of the footprint, texture space").count(2)), size_(tool) {}

Footprint FootprintOptions::footprint() const { return size_.at(wrappedUv(uv_[0], uv_[1])); }

}  // namespace glint::apps
