#include <fmt/format.h>

#include <nlohmann/json.hpp>

#include "glint-bench/lab/ndf_figures.h"
#include "glint-bench/presets/preset.h"
#include "measure/bench_times.h"
#include "measure/workload.h"

namespace glint::apps {
namespace {

constexpr double kMebi = 1 << 20;  // the unit of the paper, whose MB these are: 5,723 images of 256^2 floats are 1430.75

Candidate pyramid(int stride, const std::vector<std::string>& more = {}) {
  Candidate c{"pyramid", fmt::format("stride {}", stride), "glint-pyramid", {"--stride", std::to_string(stride)}, "", true};
  c.flags.insert(c.flags.end(), more.begin(), more.end());
  return c;
}

Candidate cp(const Candidate& source, int rank) {
  const std::string text = std::to_string(rank);
  return {"cp", "rank " + text, "glint-compress", {"--method", "cp", "--rank", text}, source.name(), true};
}

double imagesOf(const PyramidShape& shape) {
  double count = 0;
  for (int l = 0; l < shape.level_count; ++l) count += static_cast<double>(shape.levels[l].imageCount());
  return count;
}

/// Images of the paper's grid: one at each of the (N + 1)^2 corners of the N^2 squares of a level, with N halved from level
/// to level down to one square, and one more.
double cornerImages(int texels, int stride) {
  double count = 1;
  for (int squares = texels / stride; squares >= 1; squares /= 2) count += (squares + 1.0) * (squares + 1.0);
  return count;
}

/// A row of Table 2, as the paper prints it.
struct Table2Row {
  const char* texture;
  bake::SynthKind kind;
  int texels, stride, rank;
  double pyramid_minutes, compression_minutes, pyramid_mb, compressed_mb, ratio_percent;
};
constexpr Table2Row kTable2[] = {
    {"metallic flakes", bake::SynthKind::flakes, 2048, 32, 32, 42.80, 60.01, 1430.75, 106.86, 7.47},
    {"brushed metal", bake::SynthKind::brushed, 2048, 32, 16, 37.39, 10.01, 1430.75, 15.19, 1.06},
    {"brushed metal", bake::SynthKind::brushed, 1024, 32, 16, 9.56, 5.36, 374.50, 7.18, 1.92},
    {"isotropic noise", bake::SynthKind::isotropic, 512, 16, 16, 59.71, 25.32, 374.50, 6.87, 1.83},
};

void addTable2Row(PresetRun& run, const Table2Row& row) {
  const int texels = run.sizeOf(row.texels);
  const LabMap& map = run.map(row.kind, texels);
  const Candidate images = pyramid(row.stride), compressed = cp(images, row.rank);
  const std::string subject = fmt::format("{} {}^2, stride {}, rank {}", row.texture, texels, row.stride, row.rank);
  const double pyramid_bytes = run.lab.bytesOf(map, images), bytes = run.lab.bytesOf(map, compressed);
  const double every = 4.0 * 256 * 256 * imagesOf(run.lab.open(map, images).asset().get<NdfPyramid>().shape);
  const auto add = [&](const char* figure, const char* unit, double paper, double ours, const char* note = "") {
    run.rows.push_back({"Table 2", subject, figure, unit, paper, ours, note});
  };
  add("time of the NDF images", "s", 60 * row.pyramid_minutes, run.lab.secondsOf(map, images));
  add("time of the compression", "s", 60 * row.compression_minutes, run.lab.secondsOf(map, compressed));
  add("bytes of the paper's grid of (N + 1)^2 corners in f32", "MiB", row.pyramid_mb,
      4.0 * 256 * 256 * cornerImages(texels, row.stride) / kMebi, "counted, not made");
  add("bytes of all images in f32", "MiB", row.pyramid_mb, every / kMebi, "we store sqrt(2) more centres an axis");
  add("bytes of the pyramid, empty blocks left out", "MiB", row.pyramid_mb, pyramid_bytes / kMebi);
  add("bytes of the compressed asset", "MiB", row.compressed_mb, bytes / kMebi);
  add("compressed over all images", "%", row.ratio_percent, 100 * bytes / every);
}

void addTable2(PresetRun& run) {
  for (const Table2Row& row : kTable2) addTable2Row(run, row);
  run.rows.push_back({"Table 2",
                      "isotropic noise 8K^2, wave optics, stride 64, rank 16",
                      "all figures",
                      "",
                      {},
                      {},
                      "not repeated: 8K^2 heights in three channels ask for more memory and hours than a bench should"});
}

void addTable3(PresetRun& run) {
  const LabMap& map = run.map(bake::SynthKind::brushed, run.sizeOf(2048));
  const Candidate compressed = cp(pyramid(32), 16);
  const api::OpenedNdf ndf = run.lab.open(map, compressed, {.normals_below_level_0 = true});
  const std::vector<BenchQuery> queries = benchQueries(map.normals(), run.lab.seed(), 1 << 13, {20, 40, 80});
  const auto times = benchTimes(ndf, queries, {}, 0.05);
  run.rows.push_back({"Table 3",
                      "evaluation",
                      "time of a density",
                      "ns",
                      {},
                      times["density"]["warm"]["ns"].get<double>(),
                      "the paper's whole renders take 1.15 times those of a plain microfacet model"});
  run.rows.push_back({"Table 3",
                      "sampling",
                      "time of a sample",
                      "ns",
                      {},
                      times["sample"]["cold"]["ns"].get<double>(),
                      "the paper's whole renders take 1.92 times those of a plain microfacet model"});
}

/// Errors, bytes and times by rank. The paper prints curves without numbers.
void addRanks(PresetRun& run) {
  constexpr std::pair<bake::SynthKind, const char*> kMaps[] = {{bake::SynthKind::isotropic, "isotropic noise"},
                                                               {bake::SynthKind::brushed, "brushed metal"},
                                                               {bake::SynthKind::flakes, "metallic flakes"}};
  const std::vector<int> ranks = run.quick ? std::vector<int>{4, 16} : std::vector<int>{4, 8, 16, 32, 64};
  for (const auto& [kind, name] : kMaps) {
    const LabMap& map = run.map(kind, run.sizeOf(1024));
    const ImageTruth truth(map, roundFootprints(run.lab.seed(), 24, 28));
    const double images = run.lab.bytesOf(map, pyramid(32));
    for (const int rank : ranks) {
      const Candidate c = cp(pyramid(32), rank);
      const std::string subject = fmt::format("{}, rank {}", name, rank);
      const api::OpenedNdf ndf = run.lab.open(map, c);
      run.rows.push_back({"Fig. 18 (a)", subject, "time of the compression", "s", {}, run.lab.secondsOf(map, c)});
      run.rows.push_back(
          {"Fig. 18 (b)", subject, "compressed over stored images", "%", {}, 100 * run.lab.bytesOf(map, c) / images});
      run.rows.push_back({"Fig. 18 (d), 19, 20",
                          subject,
                          "seen error",
                          "%",
                          {},
                          100 * truth.seen(ndf),
                          "the paper: artifacts below rank 16, nearly the images themselves from 32 on"});
    }
  }
}

}  // namespace

Preset deng2022() {
  return {"deng2022",
          "Deng et al. 2022, Constant-Cost Spatio-Angular Prefiltering of Glinty Appearance Using Tensor Decomposition",
          {addTable2, addTable3, addRanks}};
}

}  // namespace glint::apps
