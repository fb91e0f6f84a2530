#include <fmt/format.h>

#include <nlohmann/json.hpp>

#include "glint-bench/presets/preset.h"
#include "glint/model/tiny_example.h"
#include "measure/bench_times.h"
#include "measure/workload.h"

namespace glint::apps {
namespace {

constexpr double kMebi = 1 << 20;

Candidate example(int texels, const char* mode) {
  return {"tiny example",
          fmt::format("{} {}^2", mode, texels),
          "glint-tiny",
          {"--cut", std::to_string(texels), "--mode", mode, "--resolution", "128", "--precision", "float"},
          "",
          false};
}

/// A material of Table 3, as the paper prints it.
struct Table3Row {
  const char* material;
  bake::SynthKind kind;
  const char* mode;
  int texels;
  double megabytes;
};
constexpr Table3Row kTable3[] = {{"structure", bake::SynthKind::leather, "tiled", 8, 1.31},
                                 {"isotropic", bake::SynthKind::isotropic, "tiled", 16, 5.32},
                                 {"brushed metal", bake::SynthKind::brushed, "tiled", 32, 21.31},
                                 {"scratches", bake::SynthKind::scratches, "scattered", 32, 85.25}};

void addTable3(PresetRun& run) {
  constexpr double kImageBytes = 4.0 * 128 * 128;
  for (const Table3Row& row : kTable3) {
    const LabMap& map = run.map(row.kind, 256);
    const Candidate c = example(row.texels, row.mode);
    const api::OpenedNdf ndf = run.lab.open(map, c);
    const auto& tiny = ndf.asset().get<TinyExample>();
    double images = 0;
    for (int l = 0; l < tiny.images.shape.level_count; ++l)
      images += static_cast<double>(tiny.images.shape.levels[l].imageCount());
    const std::string subject = fmt::format("{}, {}^2, {}", row.material, row.texels, row.mode);
    const bool larger = row.texels == 32 && row.megabytes > 50;
    run.rows.push_back({"Table 3", subject, "bytes of all images in f32", "MiB", row.megabytes, images * kImageBytes / kMebi,
                        larger ? "four times the paper's other example of this size, which ours does not need" : ""});
    run.rows.push_back({"Table 3", subject, "bytes of the asset, empty blocks left out", "MiB", row.megabytes,
                        run.lab.bytesOf(map, c) / kMebi});
    run.rows.push_back({"5", subject, "time to prepare", "s", {}, run.lab.secondsOf(map, c)});
    const std::vector<BenchQuery> queries = benchQueries(map.normals(), run.lab.seed(), 1 << 12, {0.5f, 2, 8, 32});
    run.rows.push_back({"Table 3",
                        subject,
                        "time of a density",
                        "ns",
                        {},
                        benchTimes(ndf, queries, {}, 0.05)["density"]["cold"]["ns"].get<double>(),
                        "the paper times frames on a GPU"});
  }
}

void addNotRepeated(PresetRun& run) {
  run.rows.push_back(
      {"Figs. 6 to 8, 10", "scenes", "pictures and times of frames", "", {}, {}, "scenes of the paper are not public"});
  run.rows.push_back({"Figs. 9, 12",
                      "examples against explicit maps",
                      "errors",
                      "",
                      {},
                      {},
                      "tests hold them: tests/unit/tiny_test.cpp compares the plane with brute force over the map that "
                      "glint-tiny --explicit writes"});
}

}  // namespace

Preset xing2024() {
  return {"xing2024",
          "Xing et al. 2024, A Tiny Example Based Procedural Model for Real-Time Glinty Appearance Rendering",
          {addTable3, addNotRepeated}};
}

}  // namespace glint::apps
