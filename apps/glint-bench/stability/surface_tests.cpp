#include <cmath>

#include "glint-bench/lab/ndf_figures.h"
#include "glint-bench/stability/stability_test.h"

/// Maps and materials that make methods fail.
namespace glint::apps {
namespace {

constexpr float kSigma = 20;  // of footprints, texels: more than that of level 0
constexpr double kTolerableSeen = 0.2, kTolerableVariation = 0.05;

/// Total variation of every method on one map.
void compareImages(BenchLab& lab, StabilityCurves& curves, const LabMap& map, const LabQuestion& question = {}) {
  const ImageTruth truth(map, roundFootprints(lab.seed(), lab.places(), kSigma), question);
  addEach(curves, lab, BenchLab::methods(), map, question, [&](const api::OpenedNdf& ndf) { return truth.variation(ndf); });
}

/// Seen error of every method, over half vectors of one length.
void compareRing(BenchLab& lab, StabilityCurves& curves, const LabMap& map, double radius) {
  constexpr double kWidth = 0.1;
  const ImageTruth truth(map, roundFootprints(lab.seed(), 4 * lab.places(), kSigma));
  addEach(curves, lab, BenchLab::methods(), map, {},
          [&](const api::OpenedNdf& ndf) { return truth.seenInRing(ndf, radius - 0.5 * kWidth, radius + 0.5 * kWidth); });
}

void measureRoughness(BenchLab& lab, double sigma_r, StabilityCurves& curves) {
  const LabMap& map = lab.map(lab.typical(bake::SynthKind::flakes));
  compareImages(lab, curves, map, {.sigma_r = static_cast<float>(sigma_r)});
}

void measureSteepness(BenchLab& lab, double alpha, StabilityCurves& curves) {
  bake::SynthOptions options = lab.typical(bake::SynthKind::isotropic);
  options.alpha = static_cast<float>(alpha);
  compareImages(lab, curves, lab.map(options));
}

void measureGrazing(BenchLab& lab, double radius, StabilityCurves& curves) {
  bake::SynthOptions options = lab.typical(bake::SynthKind::isotropic);
  options.alpha = 0.8f;
  compareRing(lab, curves, lab.map(options), radius);
}

void measureDimDirections(BenchLab& lab, double radius, StabilityCurves& curves) {
  compareRing(lab, curves, lab.map(lab.typical(bake::SynthKind::scratches)), radius);
}

/// A map of one normal. Its NDF is one lobe, which a method puts in its place or not.
void measureOneDirection(BenchLab& lab, double length, StabilityCurves& curves) {
  const Vec2 normal = {0.8f * static_cast<float>(length), 0.6f * static_cast<float>(length)};
  const int size = lab.mapSize();
  compareImages(lab, curves, lab.map(size, size, std::vector<Vec2>(static_cast<std::size_t>(size) * size, normal)));
}

/// Grooves of two directions.
void measureTwoLobes(BenchLab& lab, double slope, StabilityCurves& curves) {
  bake::SynthOptions options = lab.typical(bake::SynthKind::sawtooth);
  options.slope = static_cast<float>(slope);
  compareImages(lab, curves, lab.map(options));
}

/// The normals of a map after it was stored with 8 bits a channel, as glint-ingest reads them.
std::vector<Vec2> throughEightBits(const NormalMap& map, bake::Dequantize dequantize, std::uint64_t seed) {
  std::vector<std::uint8_t> codes;
  for (const Vec2 n : map.normals)
    for (const float c : {n.x, n.y, std::sqrt(std::max(0.0f, 1 - dot(n, n)))})
      codes.push_back(static_cast<std::uint8_t>(std::lround(127.5f * (c + 1))));
  bake::IngestOptions options;
  options.name = "8 bits", options.dequantize = dequantize, options.allow_constant = true, options.seed = seed;
  const auto made = bake::ingestNormals({map.width, map.height, 3, std::span<const std::uint8_t>(codes)}, options);
  return {made.normals.begin(), made.normals.end()};
}

/// Brute force over the stored texels against brute force over the original ones.
void measureEightBits(BenchLab& lab, double sigma_r, StabilityCurves& curves) {
  bake::SynthOptions options = lab.typical(bake::SynthKind::isotropic);
  options.alpha = 0.05f;
  const LabQuestion question{.sigma_r = static_cast<float>(sigma_r)};
  const LabMap& map = lab.map(options);
  // Pixels of .4 codes show the comb of the codes; those of half a code have their borders at every code.
  const ImageTruth truth(map, roundFootprints(lab.seed(), lab.places() / 2, kSigma), question, 640);
  for (const auto& [series, dequantize] : {std::pair{"8 bits as they are", bake::Dequantize::none},
                                           std::pair{"8 bits, dequantised", bake::Dequantize::automatic}}) {
    const std::vector<Vec2> stored = throughEightBits(map.normals(), dequantize, lab.seed());
    curves.add(series, truth.variation(lab.map(options.width, options.height, stored)));
  }
}

}  // namespace

std::vector<StabilityTest> surfaceTests() {
  const std::string variation = "total variation, 0 to 1", seen = "seen error";
  return {
      {"roughness",
       "Facets from mirrors to rough ones",
       "Flakes, footprints of 20 texels. The figure is the total variation from brute force with facets of the same roughness.",
       "sigma_r of a facet, disk units",
       variation,
       kTolerableVariation,
       "Take a bin map; or a pyramid, of a higher --resolution or a larger --tolerance where compression fails.",
       {0.001, 0.002, 0.005, 0.02, 0.05, 0.1, 0.2, 0.5},
       {0.002, 0.02, 0.2},
       measureRoughness},
      {"steep",
       "Steep maps",
       "Isotropic noise, footprints of 20 texels. The figure is the total variation from brute force.",
       "Beckmann roughness of the map",
       variation,
       kTolerableVariation,
       "Take a bin map or a pyramid.",
       {0.02, 0.05, 0.1, 0.2, 0.4, 0.8, 1.5},
       {0.05, 0.8},
       measureSteepness},
      {"grazing",
       "Half vectors near the horizon",
       "Isotropic noise of roughness .8, footprints of 20 texels. The figure is the seen error towards half vectors of one "
       "length.",
       "length of the half vector on the disk",
       seen,
       kTolerableSeen,
       "Take a bin map or a pyramid.",
       {0.05, 0.25, 0.5, 0.7, 0.85, 0.95},
       {0.25, 0.95},
       measureGrazing},
      {"dim",
       "Light far from the peak",
       "Scratches on a flat ground, footprints of 20 texels. Nearly all facets face up; the figure is the seen error towards "
       "half vectors of one length.",
       "length of the half vector on the disk",
       seen,
       kTolerableSeen,
       "Take a pyramid, or compress it by --tolerance.",
       {0.05, 0.15, 0.25, 0.35, 0.45},
       {0.05, 0.25},
       measureDimDirections},
      {"one-direction",
       "A map of one normal",
       "All texels have one normal. The figure is the total variation from its lobe.",
       "length of the normal on the disk",
       variation,
       kTolerableVariation,
       "Take a bin map or a pyramid.",
       {0, 0.3, 0.6, 0.9, 0.97},
       {0.3, 0.9},
       measureOneDirection},
      {"two-lobes",
       "Grooves of two directions",
       "A sawtooth, footprints of 20 texels that see both walls. The figure is the total variation from brute force.",
       "slope of the steep wall",
       variation,
       kTolerableVariation,
       "Take a bin map, or a compressed pyramid.",
       {0.01, 0.02, 0.05, 0.1, 0.2, 0.5, 1},
       {0.02, 0.5},
       measureTwoLobes},
      {"eight-bits",
       "Maps of 8 bits",
       "Isotropic noise of roughness .05, stored with 8 bits a channel, footprints of 20 texels. The figure is the total "
       "variation of brute force over the stored texels from brute force over the original ones. One code is .0078 of the "
       "disk.",
       "sigma_r of a facet, disk units",
       variation,
       kTolerableVariation,
       "Store maps with 16 bits; else dequantise (the default) for facets sharper than a third of a code, and not for rougher "
       "ones.",
       {0.001, 0.002, 0.003, 0.005, 0.01, 0.02},
       {0.001, 0.01},
       measureEightBits},
  };
}

}  // namespace glint::apps
