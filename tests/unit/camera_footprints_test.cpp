#include "measure/camera_footprints.h"

#include <gtest/gtest.h>

#include <cmath>

#include "glint/query/ray_footprint.h"
#include "measure/light_blur.h"

namespace glint::apps::camera_footprints_test {
namespace {

constexpr double kRounding = 1e-6;  // of floats in the comparison

CameraView halfMeterWide() {
  CameraView camera;
  camera.nearest = 1, camera.farthest = 8;
  camera.field_of_view_deg = 2 * std::atan(0.25) * 180 / 3.14159265358979323846;  // half a unit wide at distance 1
  camera.columns = 1000;
  return camera;
}

TEST(CameraFootprints, GrowWithTheDistance) {
  const FootprintRange range = footprintsOfCamera(halfMeterWide(), 4000);  // two texels between pixels at distance 1
  EXPECT_NEAR(range.smallest, 1, kRounding);
  EXPECT_NEAR(range.largest, 8, 8 * kRounding);
}

TEST(CameraFootprints, AreThoseThatARendererAsksFromDifferentials) {
  const FootprintRange range = footprintsOfCamera(halfMeterWide(), 4000);
  const float step_uv = 0.0005f * 4000 / 2048;
  const Footprint footprint = footprintFromDifferentials({}, {step_uv, 0}, {0, step_uv}, 2048, 2048);
  EXPECT_NEAR(std::sqrt(footprint.covariance.xx), range.smallest, kRounding);
}

TEST(CameraFootprints, OfOneOfFourSamplesAreHalfAsWide) {
  CameraView camera = halfMeterWide();
  camera.samples = 4;
  EXPECT_NEAR(footprintsOfCamera(camera, 4000).smallest, 0.5, kRounding);
}

TEST(LightBlur, KeepsTheMassAndAddsTheVarianceOfTheDisk) {
  constexpr int kSize = 128;
  constexpr double kLight_deg = 40;
  std::vector<float> image(kSize * kSize);
  image[64 * kSize + 64] = 1;
  blurByLight(image, kSize, kLight_deg);
  double mass = 0, variance = 0;
  for (int y = 0; y < kSize; ++y) {
    for (int x = 0; x < kSize; ++x) {
      const double at = image[y * kSize + x], away = (x - 64) * 2.0 / kSize;
      mass += at, variance += at * away * away;
    }
  }
  constexpr double kFloats = 1e-4, kPixels = 2e-4;  // sums of floats; the variance of a pixel, 2 * (2/128)^2 / 12, and a margin
  const double radius = halfVectorsOfLight(kLight_deg) / 2;
  EXPECT_NEAR(mass, 1, kFloats);
  EXPECT_NEAR(variance, radius * radius / 4, kPixels);
}

TEST(LightBlur, OfASharpLightChangesNothing) {
  std::vector<float> image(64, 0.0f);
  image[9] = 3;
  const std::vector<float> before = image;
  blurByLight(image, 8, 0.5);
  EXPECT_EQ(image, before);
}

}  // namespace
}  // namespace glint::apps::camera_footprints_test
