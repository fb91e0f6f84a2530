// The angular resolution of S (Wu 2019, Fig. 7): 5, 15 and 25 cells along an axis beside 45, the paper's reference.

#include <gtest/gtest.h>

#include <cmath>
#include <numbers>
#include <random>

#include "glint/bake/displace/displace.h"
#include "glint/query/brdf/displaced_brdf.h"
#include "support/test_heights.h"

namespace glint::bake {
namespace {

constexpr int kPairs = 20000;
constexpr float kSteepest = 60;  // degrees: farther out, cells of 5 x 5 directions reach into grazing angles

DisplacementData madeWith(const test::OwnedSurface& map, int angular) {
  DisplaceOptions options;
  options.factors = {32}, options.angular = angular, options.spatial = 1;
  return displace({map.width, map.height, 0, map.heights}, options);
}

/// Root mean square difference of two assets' S over random pairs of directions, relative to that of the second.
double difference(const DisplacementData& a, const DisplacementData& b) {
  const Displacement first = a.view(), second = b.view();
  const DisplacedBrdf coarse(first), fine(second);
  std::mt19937 random(3);
  std::uniform_real_distribution<float> unit(0, 1);
  const auto draw = [&] {
    const float sine = std::sin(kSteepest * std::numbers::pi_v<float> / 180) * std::sqrt(unit(random));
    const float azimuth = 2 * std::numbers::pi_v<float> * unit(random);
    return Vec3{sine * std::cos(azimuth), sine * std::sin(azimuth), std::sqrt(1 - sine * sine)};
  };
  double error = 0, all = 0;
  for (int k = 0; k < kPairs; ++k) {
    const Vec3 wi = draw(), wo = draw();
    const double x = coarse.angularScale(0, wi, wo).r, y = fine.angularScale(0, wi, wo).r;
    error += (x - y) * (x - y), all += y * y;
  }
  return std::sqrt(error / all);
}

TEST(AngularResolution, FifteenCellsAreNearTheReferenceOfFortyFive) {
  const test::OwnedSurface map = test::synthSurface(SynthKind::weave, 128, 128);
  const DisplacementData reference = madeWith(map, kMostAngular);
  double before = 1;
  for (const int angular : {5, 15, 25}) {
    const double error = difference(madeWith(map, angular), reference);
    RecordProperty("error_" + std::to_string(angular), std::to_string(error));
    std::printf("N = %d: %.4f\n", angular, error);
    EXPECT_LT(error, before) << angular;
    before = error;
    if (angular == 15) {
      EXPECT_LT(error, 0.01);
    }
  }
}

}  // namespace
}  // namespace glint::bake
