#include <cmath>
#include <numbers>

#include "glint-bench/lab/ndf_figures.h"
#include "glint-bench/stability/stability_test.h"
#include "glint/bake/common/counter_random.h"

/// Footprints of all sizes and shapes: total variation between a method's images and brute force.
namespace glint::apps {
namespace {

/// A twentieth of the facets in wrong places.
constexpr double kTolerable = 0.05;

/// Total variation of every method.
/// @param from_texels  whether to ask the pyramid with --normals too, as a series of its own
void compareImages(BenchLab& lab, StabilityCurves& curves, const LabMap& map, std::vector<Footprint> footprints,
                   LabQuestion question, bool from_texels) {
  const ImageTruth truth(map, std::move(footprints), question);
  const auto variation = [&](const api::OpenedNdf& ndf) { return truth.variation(ndf); };
  addEach(curves, lab, BenchLab::methods(), map, question, variation);
  if (!from_texels) return;
  question.normals_below_level_0 = true;
  std::vector<Candidate> pyramid = BenchLab::methods();
  std::erase_if(pyramid, [](const Candidate& c) { return c.method != "pyramid"; });
  StabilityCurves added;
  addEach(added, lab, pyramid, map, question, variation);
  for (const StabilityCurves::Point& p : added.points()) {
    const std::string series = p.series + ", --normals";
    p.message.empty() ? curves.add(series, p.value) : curves.fail(series, p.message);
  }
}

void measureSizes(BenchLab& lab, double sigma, StabilityCurves& curves) {
  const LabMap& map = lab.map(lab.typical(bake::SynthKind::scratches));
  compareImages(lab, curves, map, roundFootprints(lab.seed(), lab.places(), static_cast<float>(sigma)), {}, true);
}

void measureAspects(BenchLab& lab, double aspect, StabilityCurves& curves) {
  constexpr float kSigma = 12;
  constexpr std::uint64_t kStream = 4000;
  std::vector<Footprint> footprints;
  for (std::size_t k = 0; k < lab.places(); ++k) {
    const auto along = kSigma * kSigma * static_cast<float>(aspect), across = kSigma * kSigma / static_cast<float>(aspect);
    const float angle = std::numbers::pi_v<float> * bake::randomPair(lab.seed(), kStream, 2 * k).x;
    const float c = std::cos(angle), s = std::sin(angle);
    footprints.push_back(
        Footprint::gaussian(bake::randomPair(lab.seed(), kStream, 2 * k + 1),
                            {along * c * c + across * s * s, (along - across) * c * s, along * s * s + across * c * c}));
  }
  compareImages(lab, curves, lab.map(lab.typical(bake::SynthKind::scratches)), std::move(footprints), {}, true);
}

void measureSmoothSurfaces(BenchLab& lab, double sigma, StabilityCurves& curves) {
  // An image of triangles costs a quadrature for each pixel and triangle.
  constexpr std::size_t kPlaces = 3;
  constexpr double kLargestFromTexels = 2;
  const LabMap& map = lab.map(lab.typical(bake::SynthKind::isotropic));
  compareImages(lab, curves, map, roundFootprints(lab.seed(), kPlaces, static_cast<float>(sigma)), {.surface = Surface::smooth},
                sigma <= kLargestFromTexels);
}

}  // namespace

std::vector<StabilityTest> footprintTests() {
  const std::string figure = "total variation, 0 to 1";
  return {
      {"size",
       "Footprints far smaller and larger than the stored ones",
       "Scratches on a map that repeats. Footprints are of all sizes, up to four maps. The figure is the total variation from "
       "brute force.",
       "deviation of the footprint, texels",
       figure,
       kTolerable,
       "Give --normals to a pyramid below its finest level; lobes of moments and bins of histograms hold at no size.",
       {0.25, 1, 4, 16, 64, 256, 2048},
       {0.5, 8, 512},
       measureSizes},
      {"stretched",
       "Stretched footprints",
       "Scratches. Footprints keep their area, of 12 texels of deviation, and grow longer in random directions. The figure is "
       "the total variation from brute force.",
       "longer axis over the shorter one",
       figure,
       kTolerable,
       "Take a bin map, which answers any ellipse as one box.",
       {1, 2, 4, 8, 16, 32, 64},
       {1, 32},
       measureAspects},
      {"smooth",
       "Small footprints on smooth surfaces",
       "Isotropic noise, whose normals are interpolated between texels. The figure is the total variation from brute force "
       "over "
       "its triangles.",
       "deviation of the footprint, texels",
       figure,
       kTolerable,
       "Give --surface smooth and --normals to a pyramid: no other method knows surfaces between texels.",
       {0.25, 0.5, 1, 2, 4, 8, 16, 32},
       {0.5, 16},
       measureSmoothSurfaces},
  };
}

}  // namespace glint::apps
