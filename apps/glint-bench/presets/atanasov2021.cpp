#include <fmt/format.h>

#include <cmath>
#include <nlohmann/json.hpp>
#include <numbers>

#include "common/ndf_image.h"
#include "glint-bench/lab/ndf_figures.h"
#include "glint-bench/presets/preset.h"
#include "glint/model/bin_map.h"
#include "measure/bench_times.h"
#include "measure/workload.h"

namespace glint::apps {
namespace {

const Candidate kBinMap{"bin map", "", "glint-binmap", {}, "", false};

LabQuestion ofAlpha(double alpha) { return {.sigma_r = static_cast<float>(alpha / std::numbers::sqrt2)}; }

/// Bins and bytes by the roughness of a facet.
void addTable4(PresetRun& run) {
  constexpr double kAlphas[] = {0.0025, 0.01, 0.04, 0.16}, kBins[] = {942, 235, 59, 15};
  constexpr double kWingMirror[] = {43, 37, 36, 36}, kCarWheel[] = {15, 9, 9, 8};
  for (const int texels : {2048, 1024}) {
    const bool wide = texels == 2048;
    const LabMap& map = run.map(wide ? bake::SynthKind::flakes : bake::SynthKind::scratches, run.sizeOf(texels));
    for (std::size_t k = 0; k < std::size(kAlphas); ++k) {
      const std::string subject =
          fmt::format("{} {}^2, alpha {}", wide ? "flakes" : "scratches", run.sizeOf(texels), kAlphas[k]);
      const LabQuestion question = ofAlpha(kAlphas[k]);
      const api::OpenedNdf ndf = run.lab.open(map, kBinMap, question);
      if (wide)
        run.rows.push_back({"Table 4", subject, "bins along an axis", "", kBins[k],
                            static_cast<double>(ndf.asset().get<BinMap>().bins_per_axis)});
      run.rows.push_back({"Table 4", subject, "bytes", "MB", wide ? kWingMirror[k] : kCarWheel[k],
                          run.lab.bytesOf(map, kBinMap, question) / 1e6});
    }
  }
}

/// Preparation, on a map of the size of the paper's scenes.
void addTable3(PresetRun& run) {
  const LabMap& map = run.map(bake::SynthKind::brushed, run.sizeOf(2048));
  const LabQuestion question = ofAlpha(std::numbers::sqrt2 * 0.005);
  const std::string subject = fmt::format("brushed {}^2, sigma_r .005", run.sizeOf(2048));
  run.rows.push_back({"Table 3", subject, "time of the whole preparation", "s", 0.3, run.lab.secondsOf(map, kBinMap, question),
                      "the Kettle scene; ours is a whole process, which reads and writes files"});
  run.rows.push_back({"Table 2", subject, "memory", "MB", 36, run.lab.bytesOf(map, kBinMap, question) / 1e6});
}

/// Integral of D by roughness. The paper shows pictures: its rival does not keep the energy.
void addFigure3(PresetRun& run) {
  const LabMap& map = run.map(bake::SynthKind::isotropic, run.sizeOf(1024));
  constexpr int kPixels = 256;
  for (const float sigma_r : {0.01f, 0.05f, 0.25f}) {
    const api::OpenedNdf ndf = run.lab.open(map, kBinMap, {.sigma_r = sigma_r});
    const Footprint box = askedShape(Footprint::isotropic({0.4f, 0.6f}, 20), ndf.info());
    double sum = 0;
    for (const float d : ndfImage(ndf.model(), box, kPixels)) sum += double{d};
    run.rows.push_back({"Fig. 3",
                        fmt::format("sigma_r {}", sigma_r),
                        "integral of D",
                        "",
                        {},
                        sum * 4 / (kPixels * kPixels),
                        "a picture in the paper; 1 is right"});
  }
}

/// Time of a query as the texture is tiled more often. The paper shows convergence plots.
void addFigure7(PresetRun& run) {
  const LabMap& map = run.map(bake::SynthKind::brushed, run.sizeOf(2048));
  for (const int tiling : {1, 8}) {
    for (const double alpha : {0.005 * std::numbers::sqrt2, 0.05}) {
      const api::OpenedNdf ndf = run.lab.open(map, kBinMap, ofAlpha(alpha));
      const auto sigma = static_cast<float>(4 * tiling);
      const std::vector<BenchQuery> queries = benchQueries(map.normals(), run.lab.seed(), 1 << 12, {sigma});
      const double ns = benchTimes(ndf, queries, {}, 0.05)["density"]["cold"]["ns"];
      run.rows.push_back({"Fig. 7",
                          fmt::format("tiled x{}, alpha {:.3g}", tiling, alpha),
                          "time of a density",
                          "ns",
                          {},
                          ns,
                          "plots of whole renders in the paper"});
    }
  }
}

void addPictures(PresetRun& run) {
  run.rows.push_back({"Fig. 5",
                      "bins around a half vector",
                      "bins of a query",
                      "",
                      21,
                      {},
                      "ours takes every bin that the lobe reaches, so that its energy is kept; 21 is the paper's estimator"});
}

}  // namespace

Preset atanasov2021() {
  return {"atanasov2021",
          "Atanasov et al. 2021, A Multiscale Microfacet Model Based on Inverse Bin Mapping",
          {addTable4, addTable3, addFigure3, addPictures, addFigure7}};
}

}  // namespace glint::apps
