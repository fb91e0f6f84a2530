#include "glint/math/fresnel.h"

#include <gtest/gtest.h>

#include <complex>
#include <limits>
#include <random>

namespace glint::fresnel_test {
namespace {

constexpr float kNan = std::numeric_limits<float>::quiet_NaN();
constexpr float kInfinity = std::numeric_limits<float>::infinity();
constexpr double kRounding = 2e-5;  // differences of terms near 1 in float, squared and divided

/// Fresnel's equations with complex numbers.
double exactReflectance(double cosine, std::complex<double> index) {
  const std::complex<double> inside = std::sqrt(1.0 - (1 - cosine * cosine) / (index * index));
  const auto perpendicular = (cosine - index * inside) / (cosine + index * inside);
  const auto parallel = (index * cosine - inside) / (index * cosine + inside);
  return 0.5 * (std::norm(perpendicular) + std::norm(parallel));
}

TEST(Fresnel, AgreesWithComplexArithmetic) {
  std::mt19937 random(1);
  std::uniform_real_distribution<float> unit(0, 1);
  for (int k = 0; k < 20000; ++k) {
    const float cosine = unit(random), eta = 0.05f + 4 * unit(random), absorption = 8 * unit(random);
    ASSERT_NEAR(fresnelConductor(cosine, eta, absorption), exactReflectance(cosine, {eta, absorption}), kRounding)
        << cosine << ' ' << eta << ' ' << absorption;
    if (1 - cosine * cosine < 0.999f * eta * eta) {
      ASSERT_NEAR(fresnelDielectric(cosine, eta), exactReflectance(cosine, eta), kRounding) << cosine << ' ' << eta;
    }
  }
}

TEST(Fresnel, HasItsKnownValues) {
  EXPECT_NEAR(fresnelDielectric(1, 1.5f), 0.04f, 1e-6f);
  EXPECT_NEAR(fresnelDielectric(0, 1.5f), 1, 1e-6f);
  EXPECT_EQ(fresnelDielectric(0.3f, 1 / 1.5f), 1);  // total reflection from inside glass beyond 41.8 degrees
  EXPECT_LT(fresnelDielectric(0.8f, 1 / 1.5f), 1);
  const float brewster = 1 / std::sqrt(1 + 1.5f * 1.5f);  // only the perpendicular half is reflected: 0.148
  EXPECT_NEAR(fresnelDielectric(brewster, 1.5f), 0.5f * (1.25f / 3.25f) * (1.25f / 3.25f), 1e-6f);
  EXPECT_NEAR(fresnelConductor(1, 0.2f, 3), (0.8f * 0.8f + 9) / (1.2f * 1.2f + 9), 1e-6f);
  EXPECT_NEAR(fresnelConductor(0, 0.2f, 3), 1, 1e-6f);
}

TEST(Fresnel, ConductorsThatAbsorbNothingAreDielectrics) {
  for (float cosine = 0; cosine <= 1; cosine += 0.01f)
    for (const float eta : {1.1f, 1.5f, 2.4f})
      EXPECT_NEAR(fresnelConductor(cosine, eta, 0), fresnelDielectric(cosine, eta), kRounding) << cosine << ' ' << eta;
}

TEST(Fresnel, ChannelsHaveTheirOwnIndex) {
  const Fresnel gold = Fresnel::conductor({0.18f, 0.42f, 1.37f}, {3.42f, 2.35f, 1.77f});
  const Rgb f = gold.reflectance(0.7f);
  EXPECT_EQ(f, (Rgb{fresnelConductor(0.7f, 0.18f, 3.42f), fresnelConductor(0.7f, 0.42f, 2.35f),
                    fresnelConductor(0.7f, 1.37f, 1.77f)}));
  EXPECT_GT(f.r, f.g);
  EXPECT_GT(f.g, f.b);
  EXPECT_EQ(Fresnel::dielectric(1.5f).reflectance(0.5f), Rgb::grey(fresnelDielectric(0.5f, 1.5f)));
  EXPECT_EQ(Fresnel::mirror().reflectance(0.5f), Rgb::grey(1));
}

TEST(Fresnel, IsAShareWhateverItIsAsked) {
  for (const float cosine : {kNan, kInfinity, -kInfinity, -1.0f, 0.0f, 0.5f, 1.0f, 2.0f}) {
    for (const float eta : {0.0f, 1e-30f, 1.0f, 1e30f, kInfinity, kNan}) {
      for (const float k : {0.0f, 1.0f, 1e30f, kNan}) {
        const float dielectric = fresnelDielectric(cosine, eta), conductor = fresnelConductor(cosine, eta, k);
        EXPECT_TRUE(dielectric >= 0 && dielectric <= 1) << cosine << ' ' << eta << ": " << dielectric;
        EXPECT_TRUE(conductor >= 0 && conductor <= 1) << cosine << ' ' << eta << ' ' << k << ": " << conductor;
      }
    }
  }
}

}  // namespace
}  // namespace glint::fresnel_test
