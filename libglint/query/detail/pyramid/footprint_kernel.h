#pragma once

#include "glint/math/device.h"
#include "glint/math/float4.h"

namespace glint {

/// Weights of NDF images whose weighed sum sees a larger Gaussian footprint than each image does.
///
/// The weights are a kernel of the distance between a place and the centre of an image. Along each axis the kernel covers four
/// centres, is not negative, has a continuous slope, and its weights sum to 1. So an answer is continuous in place, and it has no
/// kink where the window of four centres moves on. The kernel follows the variance that the images lack: footprint minus image,
/// in squares of the gap between centres.
///
/// tests/bench/footprint_kernel.py fits the table: it minimises the squared difference between the footprint that the images see
/// together and the one that was asked for.
class FootprintKernel {
 public:
  /// The largest variance that the kernel has, in squares of the gap.
  static constexpr float kMostVariance = 2;

  /// Weights of the four centres around a place, in their order. Plain arithmetic: the same bits on every processor.
  /// @param variance  variance that the images lack, in squares of the gap; clamped to 0 to kMostVariance
  /// @param t         position between the middle two centres, 0 to 1
  static GLINT_HD Float4 weights(float variance, float t) {
    const float at = kNodesPerVariance * (variance > 0 ? variance < kMostVariance ? variance : kMostVariance : 0.0f);
    const int node = at < kNodes - 2 ? static_cast<int>(at) : kNodes - 2;
    const Float4 next = Float4::all(at - static_cast<float>(node)), here = Float4::all(1) - next;
    const LaneTable& table = laneTable();
    const auto term = [&](int k) {
      return here * Float4::load(table.terms[node][k]) + next * Float4::load(table.terms[node + 1][k]);
    };
    const Float4 distance = Float4::of(t, t, 1 - t, 1 - t);
    Float4 sum = term(kTerms - 1);
    for (int k = kTerms - 2; k >= 0; --k) sum = sum * distance + term(k);
    return sum.positive();  // rounding
  }

 private:
  static constexpr int kNodes = 17, kTerms = 6;
  static constexpr float kNodesPerVariance = (kNodes - 1) / kMostVariance;

  /// terms[node][k]: factors of t^k in the kernel at distance t, and at distance 1 + t.
  struct Table {
    float terms[kNodes][kTerms][2];
  };
  /// The factors for each of four centres, whose distances are 1 + t, t, 1 - t and 2 - t.
  struct LaneTable {
    float terms[kNodes][kTerms][4];
  };
  static GLINT_HD constexpr LaneTable forLanes(const Table& fitted) {
    LaneTable table = {};
    for (int node = 0; node < kNodes; ++node)
      for (int k = 0; k < kTerms; ++k)
        for (int lane = 0; lane < 4; ++lane) table.terms[node][k][lane] = fitted.terms[node][k][lane == 0 || lane == 3 ? 1 : 0];
    return table;
  }

  static GLINT_HD const LaneTable& laneTable() {
    // clang-format off
    constexpr Table kFitted = {{
      {{1.0000000f, 0.0000000f}, {0.0000000f, 0.0000000f}, {-5.6440466f, 0.0000000f},
       {12.5761862f, 0.0000000f}, {-13.2202328f, 0.0000000f}, {5.2880931f, 0.0000000f}},
      {{0.7909012f, 0.1045494f}, {0.0000000f, -0.6201302f}, {-1.8460099f, 1.0466376f},
       {1.4986605f, -0.0088805f}, {-0.2709197f, -1.1643780f}, {-0.0680826f, 0.6422017f}},
      {{0.7283376f, 0.1358312f}, {0.0000000f, -0.6139153f}, {-1.3524387f, 0.8176443f},
       {1.0053805f, -0.0104258f}, {-0.3020618f, -0.6555759f}, {0.0566135f, 0.3264416f}},
      {{0.6183171f, 0.1908415f}, {0.0000000f, -0.4774899f}, {-0.6646416f, 0.1523001f},
       {0.1468355f, 0.4942588f}, {0.0403658f, -0.4896657f}, {0.0499648f, 0.1297552f}},
      {{0.5436312f, 0.2281844f}, {0.0000000f, -0.4100633f}, {-0.2912739f, -0.3309266f},
       {-0.6589406f, 1.8120640f}, {1.0245326f, -2.1320172f}, {-0.3897648f, 0.8327586f}},
      {{0.4799995f, 0.2600002f}, {0.0000000f, -0.3260220f}, {0.4053587f, -1.2709835f},
       {-2.8416349f, 4.7643593f}, {3.6932193f, -5.7116811f}, {-1.4769424f, 2.2843271f}},
      {{0.4301125f, 0.2849438f}, {0.0000000f, -0.2112498f}, {0.7779277f, -2.3648199f},
       {-3.8825965f, 8.0415387f}, {4.9168164f, -9.5683374f}, {-1.9573162f, 3.8179246f}},
      {{0.4068678f, 0.2965661f}, {0.0000000f, -0.4353705f}, {-0.5601572f, 0.5100968f},
       {0.7963809f, -0.3111127f}, {-0.0284284f, -0.6494136f}, {-0.3180971f, 0.5892339f}},
      {{0.3497288f, 0.3251356f}, {0.0000000f, -0.0371125f}, {1.7162277f, -4.2678273f},
       {-6.9552194f, 14.0354551f}, {8.6759023f, -16.7446561f}, {-3.4615037f, 6.6890053f}},
      {{0.3140810f, 0.3429595f}, {0.0000000f, -0.0115183f}, {2.4880497f, -4.8699977f},
       {-9.7669466f, 16.2691125f}, {12.2256552f, -19.5969560f}, {-4.9178797f, 7.8664001f}},
      {{0.2904772f, 0.3547614f}, {0.0000000f, 0.1102115f}, {2.5190337f, -5.9415267f},
       {-9.7002297f, 19.3833138f}, {12.0545675f, -23.1567006f}, {-4.8090873f, 9.2499406f}},
      {{0.2616518f, 0.3691741f}, {0.0000000f, 0.1099754f}, {3.3166654f, -6.3532837f},
       {-12.6839141f, 21.1141150f}, {15.8454678f, -25.4541509f}, {-6.3706969f, 10.2141701f}},
      {{0.2409555f, 0.3795223f}, {0.0000000f, 0.1725862f}, {3.6151734f, -7.0617828f},
       {-13.7260022f, 23.3770238f}, {17.1267321f, -28.1566550f}, {-6.8773365f, 11.2893056f}},
      {{0.2221818f, 0.3889091f}, {0.0000000f, 0.2225048f}, {3.9393794f, -7.6770042f},
       {-14.8889244f, 25.3925573f}, {18.5708420f, -30.5886667f}, {-7.4545698f, 12.2616997f}},
      {{0.2049255f, 0.3975372f}, {0.0000000f, 0.2592123f}, {4.2949184f, -8.1959331f},
       {-16.1922812f, 27.1549616f}, {20.2036535f, -32.7466594f}, {-8.1136790f, 13.1308813f}},
      {{0.1898609f, 0.4050696f}, {0.0000000f, 0.2961483f}, {4.5946850f, -8.6897558f},
       {-17.2900700f, 28.8102614f}, {21.5759804f, -34.7611966f}, {-8.6653866f, 13.9394731f}},
      {{0.1779918f, 0.4110041f}, {0.0000000f, 0.3506254f}, {4.7250115f, -9.2501336f},
       {-17.7316633f, 30.5459792f}, {22.1027280f, -36.7990797f}, {-8.8630639f, 14.7416046f}},
    }};
    // clang-format on
    static constexpr LaneTable kTable = forLanes(kFitted);
    return kTable;
  }
};

}  // namespace glint
