#include <fmt/format.h>

#include <cmath>

#include "glint-bench/lab/ndf_figures.h"
#include "glint-bench/lab/sun_light.h"
#include "glint-bench/presets/preset.h"
#include "glint/bake/sh/lobes.h"

namespace glint::apps {
namespace {

constexpr double kMega = 1e6;

Candidate histograms(const std::string& bins, int stride) {
  return {"histograms", fmt::format("{} bins, stride {}", bins, stride),
          "glint-sat",  {"--bins", bins, "--stride", std::to_string(stride)},
          "",           false};
}

/// Section 6.1: bytes of the table of sums.
void addTables(PresetRun& run) {
  constexpr double kBins = 9 * 32, kBytes = 2;
  for (const auto& [texels, printed] : {std::pair{1024, 576.0}, {2048, 1100.0}}) {
    const LabMap& map = run.map(bake::SynthKind::scratches, run.sizeOf(texels));
    for (const int stride : {8, 16}) {
      const Candidate c = histograms("9x32", stride);
      const std::string subject = fmt::format("scratches {}^2, 9 x 32 bins, stride {}", run.sizeOf(texels), stride);
      run.rows.push_back({"6.1", subject, "bytes", "MB", printed, run.lab.bytesOf(map, c) / kMega,
                          texels == 2048 ? fmt::format("two bytes a bin are {:.0f} MiB, as Table 1 of the paper totals",
                                                       kBins * kBytes * texels * texels / (1 << 20))
                                         : ""});
      run.rows.push_back({"6.1", subject, "time to prepare", "s", 9, run.lab.secondsOf(map, c), "at most, for all structures"});
    }
  }
}

/// Section 6.2: bytes of tables of turned lobes.
void addLobes(PresetRun& run) {
  for (const auto& [order, printed] : {std::pair{30, 29.0}, {60, 114.0}, {150, 714.0}}) {
    if (run.quick && order > 60) continue;
    bake::ShLobesOptions options;
    options.order = order, options.precision = ShPrecision::f32;
    const bake::ShLobesData data = bake::buildShLobes(options);
    const std::string subject = fmt::format("order {}, 65 x 128 directions", order);
    run.rows.push_back({"6.2", subject, "bytes in f32", "MB", printed,
                        static_cast<double>(data.floats.size() * sizeof(float)) / kMega,
                        "queries turn the lobe exactly and need no table"});
  }
}

/// Figs. 11 and 15: errors by the number of bins.
void addBins(PresetRun& run) {
  for (const auto& [kind, name] :
       {std::pair{bake::SynthKind::scratches, "scratches"}, {bake::SynthKind::isotropic, "isotropic"}}) {
    const LabMap& map = run.map(kind, run.sizeOf(1024));
    const ImageTruth truth(map, roundFootprints(run.lab.seed(), 12, 20), {.sigma_r = 0.05f});
    for (const char* bins : {"3x8", "5x16", "9x32", "18x64", "32x64"}) {
      const api::OpenedNdf ndf = run.lab.open(map, histograms(bins, 8));
      run.rows.push_back({"Figs. 11, 15",
                          fmt::format("{}, {} bins", name, bins),
                          "total variation, sigma_r .05",
                          "",
                          {},
                          truth.variation(ndf),
                          "pictures in the paper, which takes 9 x 32"});
    }
  }
}

/// Fig. 17: the grid of outgoing directions of the light, against the paper's own.
void addLightGrids(PresetRun& run) {
  constexpr int kOrder = 30;
  const bake::Environment light = sunLight();
  const std::vector<double> finest = sunAnswers(light, kOrder, ShWindow::none, {65, 128});
  for (const ShGrid grid : {ShGrid{9, 16}, {17, 32}, {33, 64}}) {
    const std::vector<double> answers = sunAnswers(light, kOrder, ShWindow::none, grid);
    double error = 0, norm = 0;
    for (std::size_t k = 0; k < finest.size(); ++k) error += std::pow(answers[k] - finest[k], 2), norm += finest[k] * finest[k];
    run.rows.push_back({"Fig. 17",
                        fmt::format("{} x {} directions, order {}", grid.rows, grid.columns, kOrder),
                        "RMS difference from 65 x 128",
                        "%",
                        {},
                        100 * std::sqrt(error / norm),
                        "minor, says the paper"});
  }
}

void addNotRepeated(PresetRun& run) {
  run.rows.push_back({"Fig. 16",
                      "directions of the table of turned lobes",
                      "error",
                      "",
                      {},
                      {},
                      "queries turn lobes exactly: there is no such error"});
  run.rows.push_back({"Table 1", "whole scenes", "time of a render", "", {}, {}, "scenes of the paper are not public"});
}

}  // namespace

Preset gamboa2018() {
  return {"gamboa2018",
          "Gamboa et al. 2018, Scalable Appearance Filtering for Complex Lighting Effects",
          {addTables, addLobes, addBins, addLightGrids, addNotRepeated}};
}

}  // namespace glint::apps
