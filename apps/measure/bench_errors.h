#pragma once

#include <nlohmann/json_fwd.hpp>
#include <vector>

#include "glint/api/any_ndf.h"
#include "measure/workload.h"

namespace glint::apps {

/// The exact NDF images of a set of footprints.
class SetTruth {
 public:
  /// Pixels of an image along each axis.
  static constexpr int kResolution = 128;

  /// @param sigma_r    intrinsic roughness of the facets, disk units
  /// @param light_deg  angular diameter of the light under which errors are seen, degrees: images are blurred by it
  SetTruth(const NormalMap& map, const FootprintSet& set, float sigma_r = kBenchSigmaR, double light_deg = 0);

  const FootprintSet& set() const { return *set_; }

  /// Errors of a model over the set: {shape, sigma_texels, places, as_asked, seen, seen_worst, bias, rel_l2, tv, energy}. Stops after
  /// `budget_s` seconds, with fewer places than the set has; at least one.
  /// @param first  set to the model's image of the first place
  nlohmann::json errorsOf(const api::OpenedNdf& ndf, double budget_s, std::vector<float>& first) const;

  /// The exact image of the first place.
  const std::vector<float>& firstImage() const { return images_.front(); }

 private:
  const FootprintSet* set_;
  double light_deg_;
  std::vector<std::vector<float>> images_;
};

}  // namespace glint::apps
