#include "glint-bench/lab/bench_lab.h"
#include "glint-bench/lab/white_furnace.h"
#include "glint-bench/stability/stability_test.h"
#include "glint/bake/displace/displace.h"

/// Downsampled displacement of deep relief.
namespace glint::apps {
namespace {

constexpr double kTolerable = 0.05;
constexpr int kFactor = 32;

/// A weave of white threads with this slope.
std::vector<float> weave(const BenchLab& lab, double slope) {
  bake::SynthOptions options = lab.typical(bake::SynthKind::weave);
  options.slope = static_cast<float>(slope);
  return bake::synthHeights(options);
}

bake::DisplacementData downsampled(const BenchLab& lab, const std::vector<float>& heights, int spatial) {
  bake::DisplaceOptions made;
  made.factors = {kFactor}, made.spatial = spatial, made.seed = lab.seed();
  return bake::displace({lab.mapSize(), lab.mapSize(), 0, heights}, made);
}

void measureDepth(BenchLab& lab, double slope, StabilityCurves& curves) {
  constexpr int kPatches = 4;
  const bake::DisplacementData data = downsampled(lab, weave(lab, slope), kPatches);
  const Displacement asset = data.view();
  const DisplacedBrdf brdf(asset);
  for (const auto& [series, variant] : {std::pair{"T S and lobes", DisplacedVariant::full},
                                        {"lobes alone", DisplacedVariant::lobes},
                                        {"one lobe with Smith's masking", DisplacedVariant::single}}) {
    curves.add(series, meanFurnaceError(brdf, variant));
  }
}

void measureFactors(BenchLab& lab, double slope, StabilityCurves& curves) {
  std::vector<float> heights = weave(lab, slope);
  fadeRelief(heights, lab.mapSize());
  for (const int patches : {1, 4, 8}) {
    const bake::DisplacementData data = downsampled(lab, heights, patches);
    const std::string series = std::to_string(patches) + " x " + std::to_string(patches) + " patches";
    curves.add(series, data.shape.levels[0].rank1_residual);
  }
}

}  // namespace

std::vector<StabilityTest> reliefTests() {
  return {
      {"relief",
       "Deep relief",
       "A weave of white threads, downsampled by 32. Under an even sky all light comes back; the figure is how far the "
       "prefiltered surface is from that, over views up to 70 degrees. One lobe keeps no interreflection.",
       "steepest slope of the map",
       "light lost or gained",
       kTolerable,
       "Keep finer levels (--factors) for relief that is deeper, and let the renderer trace it.",
       {0.25, 0.5, 1, 2, 4},
       {0.5, 2},
       measureDepth},
      {"factors",
       "Scaling factors that are no product",
       "The same weave, whose relief fades to flat ground over the map. T of the place and S of the directions stand for one "
       "function of both; the figure is the distance between the two, relative to the function.",
       "steepest slope of the map",
       "distance of T S",
       kTolerable,
       "Take a larger --factor, so that cells of one patch look alike, or finer levels for views from near.",
       {0.25, 0.5, 1, 2, 4},
       {0.5, 2},
       measureFactors}};
}

}  // namespace glint::apps
