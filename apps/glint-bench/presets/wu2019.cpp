#include <fmt/format.h>

#include <chrono>
#include <cmath>

#include "glint-bench/lab/white_furnace.h"
#include "glint-bench/presets/preset.h"
#include "glint/bake/displace/displace.h"

namespace glint::apps {
namespace {

/// The width of a thread of the weave: cells of whole threads are flat, so that all light of a furnace is in the BRDF.
constexpr int kThreads = 32;

struct TimedDisplacement {
  bake::DisplacementData data;
  double seconds;
};

TimedDisplacement timed(const std::vector<float>& heights, int texels, const bake::DisplaceOptions& options) {
  const auto start = std::chrono::steady_clock::now();
  TimedDisplacement made{bake::displace({texels, texels, 0, heights}, options), 0};
  made.seconds = std::chrono::duration<double>(std::chrono::steady_clock::now() - start).count();
  return made;
}

std::vector<float> heightsOf(const PresetRun& run, bake::SynthKind kind, int texels) {
  bake::SynthOptions options = bake::defaultSynthOptions(kind);
  options.width = options.height = texels, options.seed = run.lab.seed();
  if (kind == bake::SynthKind::isotropic) options.alpha = 0.5f;
  return bake::synthHeights(options);
}

double kilobytes(const bake::DisplacementData& data) {
  double bytes = 0;
  for (const bake::DisplacementData::Level& level : data.levels)
    bytes += static_cast<double>(level.heights.size() * sizeof(float) + level.lobes.size() * sizeof(VmfLobe) +
                                 (level.spatial_scale.size() + level.spatial_terms.size()) * sizeof(float) +
                                 (level.angular_scale.size() + level.angular_terms.size()) * sizeof(std::uint16_t));
  return bytes / 1e3;
}

/// A model of Table 3, as the paper prints it.
struct Table3Row {
  const char* model;
  bake::SynthKind kind;
  bool glossy;
  int factor;
  double kilobytes, minutes;
};
constexpr Table3Row kTable3[] = {
    {"twill", bake::SynthKind::weave, true, 8, 2377, 22},
    {"silk", bake::SynthKind::weave, true, 16, 1085, 22},
    {"bump", bake::SynthKind::leather, false, 16, 704, 24},
    {"noise", bake::SynthKind::isotropic, false, 64, 239, 22},
};

void addTable3(PresetRun& run) {
  for (const Table3Row& row : kTable3) {
    const int texels = run.sizeOf(1024);
    bake::DisplaceOptions options;
    options.factors = {row.factor}, options.seed = run.lab.seed();
    if (row.glossy) options.base = {BaseBrdf::Kind::ggx, 1, 0.3f, 1, 0};
    const TimedDisplacement made = timed(heightsOf(run, row.kind, texels), texels, options);
    const std::string subject =
        fmt::format("the like of {}, {}^2, {}, by {}", row.model, texels, row.glossy ? "glossy" : "diffuse", row.factor);
    run.rows.push_back({"Table 3", subject, "size of the prefiltered model", "kB", row.kilobytes, kilobytes(made.data)});
    run.rows.push_back({"Table 3", subject, "time to prepare", "s", 60 * row.minutes, made.seconds});
    run.rows.push_back({"Fig. 6", subject, "energy of the largest singular value", "%", 95,
                        100.0 * made.data.shape.levels[0].rank1_energy, "at least, for silk and twill"});
    std::string shares;
    for (const float share : made.data.levels[0].singular_shares) shares += fmt::format(" {:.3g}", 100 * share);
    run.rows.push_back({"Fig. 6",
                        subject,
                        "energy of the second singular value",
                        "%",
                        {},
                        100.0 * made.data.levels[0].singular_shares[1],
                        "of the first eight:" + shares});
    run.rows.push_back({"Fig. 10",
                        subject,
                        "distance of T S from R",
                        "%",
                        {},
                        100.0 * made.data.shape.levels[0].rank1_residual,
                        fmt::format("the best factorisation has {:.3g} %",
                                    100 * std::sqrt(std::max(0.0f, 1 - made.data.shape.levels[0].rank1_energy)))});
  }
}

/// Figs. 7 and 8: the angular resolution.
void addAngular(PresetRun& run) {
  const int texels = run.sizeOf(512);
  const std::vector<float> heights = heightsOf(run, bake::SynthKind::weave, texels);
  for (const int angular : {5, 15, 25, 45}) {
    if (angular == 45 && run.quick) continue;  // 2025^2 pairs of directions for each walk, however small the map
    bake::DisplaceOptions options;
    options.factors = {kThreads}, options.angular = angular, options.spatial = 1, options.seed = run.lab.seed();
    const TimedDisplacement made = timed(heights, texels, options);
    const std::string subject = fmt::format("N = {}, M = 1, white weave {}^2", angular, texels);
    const Displacement asset = made.data.view();
    run.rows.push_back({"Figs. 7, 8",
                        subject,
                        "light lost or gained in a white furnace",
                        "%",
                        {},
                        100 * meanFurnaceError(DisplacedBrdf(asset), DisplacedVariant::full),
                        "pictures in the paper, which takes N = 15"});
    run.rows.push_back({"Figs. 7, 8", subject, "time to prepare", "s", {}, made.seconds});
  }
}

/// Fig. 9: the spatial resolution, on relief that fades over the map.
void addSpatial(PresetRun& run) {
  const int texels = run.sizeOf(512);
  std::vector<float> heights = heightsOf(run, bake::SynthKind::weave, texels);
  fadeRelief(heights, texels);
  for (const int spatial : {1, 4, 16}) {
    bake::DisplaceOptions options;
    options.factors = {kThreads}, options.spatial = spatial, options.seed = run.lab.seed();
    const TimedDisplacement made = timed(heights, texels, options);
    run.rows.push_back({"Fig. 9",
                        fmt::format("M = {}, weave that fades {}^2", spatial, texels),
                        "distance of T S from R",
                        "%",
                        {},
                        100.0 * made.data.shape.levels[0].rank1_residual,
                        "R has as many patches as T, so it is another R for each M"});
    options.scale_tolerance = 0.05f;
    const TimedDisplacement more = timed(heights, texels, options);
    run.rows.push_back(
        {"Fig. 10",
         fmt::format("M = {}, weave that fades {}^2, terms to 5 %", spatial, texels),
         "distance of the terms from R",
         "%",
         {},
         100.0 * more.data.shape.levels[0].scale_residual,
         fmt::format("{} terms, {:.0f} kB; the paper keeps one", more.data.shape.more_terms + 1, kilobytes(more.data))});
  }
}

/// Fig. 13: the furnace of the prefiltered model, with one bounce and with all.
void addFurnace(PresetRun& run) {
  const int texels = run.sizeOf(512);
  const std::vector<float> heights = heightsOf(run, bake::SynthKind::weave, texels);
  for (const bool all : {false, true}) {
    bake::DisplaceOptions options;
    options.factors = {kThreads}, options.seed = run.lab.seed();
    if (!all) options.bounces = 1;
    const TimedDisplacement made = timed(heights, texels, options);
    const Displacement asset = made.data.view();
    run.rows.push_back({"Fig. 13",
                        all ? "all bounces" : "one bounce",
                        "light lost in a white furnace",
                        "%",
                        {},
                        100 * meanFurnaceError(DisplacedBrdf(asset), DisplacedVariant::full),
                        all ? "negligible, says the paper" : "significant, says the paper"});
  }
}

}  // namespace

Preset wu2019() {
  return {"wu2019",
          "Wu et al. 2019, Accurate Appearance Preserving Prefiltering for Rendering Displacement-Mapped Surfaces",
          {addTable3, addAngular, addSpatial, addFurnace}};
}

}  // namespace glint::apps
