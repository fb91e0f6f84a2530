#include <cmath>
#include <numbers>

#include "glint-bench/lab/ndf_figures.h"
#include "glint-bench/stability/stability_test.h"
#include "glint/bake/common/counter_random.h"
#include "measure/workload.h"

/// Flicker (section 3 of the design): what changes from frame to frame that the surface does not change.
namespace glint::apps {
namespace {

constexpr std::uint64_t kStream = 3000;
constexpr int kHalvesOfPlace = 4;
/// Flicker over the truth's: a tenth more is not seen beside the truth's own.
constexpr double kTolerable = 1.1;

/// Paths of a footprint, each towards some lit half vectors.
/// @param step  (int k) -> the question at step k, from -steps to steps
template <class Step>
void addPaths(std::vector<Path>& paths, const NormalMap& map, const Footprint& start, std::uint64_t seed, int steps,
              Step&& step) {
  for (int k = 0; k < kHalvesOfPlace; ++k) {
    const Vec2 away = bake::randomGaussians(seed, kStream + 1, paths.size());
    const Vec2 half = litNormal(map, start.centre, std::sqrt(start.covariance.xx), away);
    Path& path = paths.emplace_back();
    for (int s = -steps; s <= steps; ++s) path.push_back(step(s, half));
  }
}

/// A footprint that moves in a random direction by 1/8 of a texel, through a random place or through a point of the border of
/// the map at u = 0.
std::vector<Path> movingPaths(const BenchLab& lab, const NormalMap& map, float sigma, bool over_border) {
  constexpr int kSteps = 32;
  constexpr float kStep = 0.125f;
  std::vector<Path> paths;
  for (std::size_t k = 0; k < lab.places(); ++k) {
    Footprint start = roundFootprints(lab.seed(), k + 1, sigma).back();
    if (over_border) start.centre.x = 0;
    const float angle = 2 * std::numbers::pi_v<float> * bake::randomPair(lab.seed(), kStream, k).x;
    const Vec2 step = {kStep * std::cos(angle) / static_cast<float>(map.width),
                       kStep * std::sin(angle) / static_cast<float>(map.height)};
    addPaths(paths, map, start, lab.seed(), kSteps, [&](int s, Vec2 half) {
      return PathStep{Footprint::isotropic(start.centre + static_cast<float>(s) * step, sigma), half};
    });
  }
  return paths;
}

/// A footprint that grows by 1 % a step, over an octave.
std::vector<Path> growingPaths(const BenchLab& lab, const NormalMap& map, float sigma) {
  constexpr int kSteps = 35;
  std::vector<Path> paths;
  for (const Footprint& start : roundFootprints(lab.seed(), lab.places(), sigma)) {
    addPaths(paths, map, start, lab.seed(), kSteps, [&](int s, Vec2 half) {
      return PathStep{Footprint::isotropic(start.centre, sigma * std::pow(1.01f, static_cast<float>(s))), half};
    });
  }
  return paths;
}

/// A light that turns, so that the half vector moves by 1/1024 of the disk's width a step, over more than a block of images.
std::vector<Path> turningPaths(const BenchLab& lab, const NormalMap& map, float sigma) {
  constexpr int kSteps = 40;
  constexpr float kStep = 2.0f / 1024;
  std::vector<Path> paths;
  for (const Footprint& start : roundFootprints(lab.seed(), lab.places(), sigma)) {
    const float angle = 2 * std::numbers::pi_v<float> * bake::randomPair(lab.seed(), kStream + 2, paths.size()).x;
    const Vec2 step = {kStep * std::cos(angle), kStep * std::sin(angle)};
    addPaths(paths, map, start, lab.seed(), kSteps, [&](int s, Vec2 half) {
      return PathStep{start, half + static_cast<float>(s) * step};
    });
  }
  return paths;
}

/// The same paths with the boxes that methods without Gaussians are asked for.
std::vector<Path> withBoxes(std::vector<Path> paths) {
  for (Path& path : paths)
    for (PathStep& step : path) step.footprint = askedShape(step.footprint, api::NdfInfo{});
  return paths;
}

/// Flicker of every method over that of the truth for the footprints it knows.
void compareFlicker(BenchLab& lab, StabilityCurves& curves, const LabMap& map, const std::vector<Path>& paths) {
  const LabQuestion question{.normals_below_level_0 = true};
  const api::OpenedNdf truth = BenchLab::truth(map, question);
  const double of_gaussians = flicker(truth, paths), of_boxes = flicker(truth, withBoxes(paths));
  addEach(curves, lab, BenchLab::methods(), map, question, [&](const api::OpenedNdf& ndf) {
    return flicker(ndf, paths) / (ndf.info().shapes.gaussians ? of_gaussians : of_boxes);
  });
}

using MakePaths = std::vector<Path> (*)(const BenchLab&, const NormalMap&, float);

StabilityTest flickerTest(const std::string& name, const std::string& title, const std::string& change,
                          const std::string& instead, MakePaths paths) {
  StabilityTest test;
  test.name = name, test.title = title, test.instead = instead;
  test.question = "Flakes. " + change +
                  " The figure is flicker, the RMS of second differences of densities, over the flicker of brute force.";
  test.axis = "deviation of the footprint, texels", test.figure = "flicker over the truth's";
  test.tolerable = kTolerable;
  test.values = {2, 4, 8, 16, 32}, test.quick_values = {4, 16};
  test.measure = [paths](BenchLab& lab, double sigma, StabilityCurves& curves) {
    const LabMap& map = lab.map(lab.typical(bake::SynthKind::flakes));
    compareFlicker(lab, curves, map, paths(lab, map.normals(), static_cast<float>(sigma)));
  };
  return test;
}

/// The density of brute force is so even in the size that its flicker is no measure: second differences over densities.
void measureGrowth(BenchLab& lab, double sigma, StabilityCurves& curves) {
  const LabMap& map = lab.map(lab.typical(bake::SynthKind::flakes));
  const LabQuestion question{.normals_below_level_0 = true};
  const std::vector<Path> paths = growingPaths(lab, map.normals(), static_cast<float>(sigma));
  const api::OpenedNdf truth = BenchLab::truth(map, question);
  curves.add("brute force", flicker(truth, paths));
  curves.add("brute force, boxes", flicker(truth, withBoxes(paths)));
  addEach(curves, lab, BenchLab::methods(), map, question, [&](const api::OpenedNdf& ndf) { return flicker(ndf, paths); });
}

}  // namespace

std::vector<StabilityTest> motionTests() {
  const std::string finer =
      "Take a bin map, which flickers as brute force does; or a pyramid with --normals for small footprints.";
  return {
      flickerTest("moving", "The footprint moves", "Footprints move by 1/8 of a texel a step.", finer,
                  [](const BenchLab& lab, const NormalMap& map, float sigma) { return movingPaths(lab, map, sigma, false); }),
      flickerTest("border", "The footprint moves over the border of the map",
                  "Footprints move by 1/8 of a texel a step, over u = 0, where cells, clusters and the map end.", finer,
                  [](const BenchLab& lab, const NormalMap& map, float sigma) { return movingPaths(lab, map, sigma, true); }),
      {"growing",
       "The footprint grows",
       "Flakes. Footprints grow by 1 % a step, over an octave around the size. The figure is the RMS of second differences "
       "over "
       "the RMS of densities.",
       "deviation of the footprint, texels",
       "second differences over densities",
       0.005,
       "Take larger footprints, or a pyramid of a smaller --stride, whose levels hand over where pixels are near.",
       {2, 4, 8, 16, 32},
       {4, 16},
       measureGrowth},
      flickerTest("turning", "The light turns",
                  "Half vectors move by 1/1024 of the disk a step, over blocks and bins of directions.",
                  "Take a bin map, or a pyramid of a higher --resolution.", turningPaths),
  };
}

}  // namespace glint::apps
