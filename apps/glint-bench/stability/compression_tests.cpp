#include <fmt/format.h>

#include "glint-bench/lab/ndf_figures.h"
#include "glint-bench/stability/stability_test.h"

/// Compression by too few columns, too many, and on maps that differ by chance only.
namespace glint::apps {
namespace {

constexpr float kSigma = 28;  // of footprints, texels: near the size of level 1
constexpr double kTolerable = 0.2;

Candidate cpOfRank(int rank) {
  const std::string text = fmt::format("{}", rank);
  return {"cp", "rank " + text, "glint-compress", {"--method", "cp", "--rank", text}, "pyramid, stride 32", true};
}

const LabMap& flakes(BenchLab& lab, std::uint64_t seed) {
  bake::SynthOptions options = lab.typical(bake::SynthKind::flakes);
  options.seed = seed;
  return lab.map(options);
}

void measureRanks(BenchLab& lab, double rank, StabilityCurves& curves) {
  const LabMap& map = flakes(lab, lab.seed());
  const ImageTruth truth(map, roundFootprints(lab.seed(), 4 * lab.places(), kSigma));
  try {
    const api::OpenedNdf ndf = lab.open(map, cpOfRank(static_cast<int>(rank)));
    curves.add("cp: seen error", truth.seen(ndf));
    curves.add("cp: bias", truth.bias(ndf));
    curves.add("cp: total variation", truth.variation(ndf));
  } catch (const std::exception& error) {
    for (const char* series : {"cp: seen error", "cp: bias", "cp: total variation"}) curves.fail(series, error.what());
  }
}

void measureSeeds(BenchLab& lab, double seed, StabilityCurves& curves) {
  const LabMap& map = flakes(lab, static_cast<std::uint64_t>(seed));
  const ImageTruth truth(map, roundFootprints(lab.seed(), 4 * lab.places(), kSigma));
  std::vector<Candidate> compressed;
  for (const Candidate& c : BenchLab::methods())
    if (c.tool == "glint-compress") compressed.push_back(c);
  addEach(curves, lab, compressed, map, {}, [&](const api::OpenedNdf& ndf) { return truth.seen(ndf); });
}

}  // namespace

std::vector<StabilityTest> compressionTests() {
  return {
      {"rank",
       "CP of few and of many columns",
       "Flakes, footprints of 28 texels. The figures are errors of glint-compress --method cp against brute force. Low ranks "
       "have negative parts, which are cut; high ranks could degenerate.",
       "rank",
       "error",
       kTolerable,
       "Take --method tucker --tolerance, which chooses ranks by the error.",
       {1, 2, 4, 8, 16, 32, 64},
       {4, 64},
       measureRanks},
      {"chance",
       "Maps that differ by chance only",
       "Flakes of several seeds, footprints of 28 texels. Decompositions start from the map itself and not from random "
       "numbers, "
       "so the map is what chance changes. The figure is the seen error.",
       "seed of the map",
       "seen error",
       kTolerable,
       "Take a tolerance, not a rank: a rank does not say what error comes out.",
       {1, 2, 3, 4, 5},
       {1, 2},
       measureSeeds},
  };
}

}  // namespace glint::apps
