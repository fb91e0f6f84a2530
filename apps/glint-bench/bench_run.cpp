#include "glint-bench/bench_run.h"

#include <fmt/format.h>

#include <algorithm>
#include <filesystem>
#include <list>
#include <map>

#include "common/child_process.h"
#include "common/input_asset.h"
#include "glint-bench/rounded_image.h"
#include "glint/formats/hash.h"
#include "measure/bench_errors.h"
#include "measure/bench_times.h"
#include "measure/candidates.h"
#include "measure/lit_picture.h"

namespace glint::apps {
namespace {

namespace fs = std::filesystem;
using Json = nlohmann::ordered_json;

/// Checks that an asset can be measured, so that one that cannot does not end a bench when others were measured for minutes.
void checkKind(const std::string& path) {
  const formats::Asset asset = formats::Asset::open(path);
  if (asset.kind() == "normals") return;
  throw Error(ErrorCode::unsupported, "format.kind", path, "", "is of kind " + std::string(asset.kind()) + ", not normals",
              "give the asset that glint-ingest made");
}

/// One map: its asset, and the questions that every method is asked.
class BenchMap {
 public:
  BenchMap(const Tool& tool, const std::string& path, const BenchSettings& settings)
      : path_(path),
        asset_(openInput(tool, path)),
        hash_(formats::hashFile(path)),
        picture_pixels_(settings.picture_pixels),
        picture_sizes_(settings.picture_sizes) {
    constexpr int kQueries = 1 << 14, kOfSize = 1 << 12, kTruthsOfPlace = 4;
    sets_ = benchFootprints(map(), tool.seed(), settings.places, kTruthsOfPlace * settings.places);
    const std::vector<float> sizes = roundSizes(sets_);
    queries_ = benchQueries(map(), tool.seed(), kQueries, sizes);
    for (const float sigma : sizes) sized_queries_.push_back({sigma, benchQueries(map(), tool.seed() + 1, kOfSize, {sigma})});
  }

  const std::string& path() const { return path_; }
  const std::string& hash() const { return hash_; }
  std::string name() const { return fs::path(path_).stem().string(); }
  const NormalMap& map() const { return asset_.get<NormalMap>(); }
  const std::vector<BenchQuery>& queries() const { return queries_; }
  const std::vector<SizedQueries>& sizedQueries() const { return sized_queries_; }

  /// The exact images, which are computed on the first call.
  const std::list<SetTruth>& truths() {
    if (truths_.empty())
      for (const FootprintSet& set : sets_) truths_.emplace_back(map(), set);
    return truths_;
  }

  /// The exact pictures of a plane and a sphere, of every second size of round footprints; computed on the first call.
  const std::vector<LitTruth>& pictures() {
    if (!pictures_.empty()) return pictures_;
    const std::vector<float> sizes = roundSizes(sets_);
    std::vector<float> chosen;
    for (std::size_t k = 0; k < sizes.size() && chosen.size() < picture_sizes_; k += 2) chosen.push_back(sizes[k]);
    return pictures_ = litTruths(map(), chosen, picture_pixels_);
  }

  /// {name, hash, width, height, truth, pictures}: with an image of each size of round footprints.
  Json json() {
    Json images = Json::array();
    for (const SetTruth& truth : truths())
      if (truth.set().shape == FootprintShape::round)
        images.push_back({{"sigma_texels", truth.set().sigma_texels}, {"image", roundedImage(truth.firstImage())}});
    Json pictures = Json::array();
    for (const LitTruth& truth : this->pictures()) pictures.push_back(Json(truth.json()));
    return {{"name", name()},
            {"hash", hash_},
            {"width", map().width},
            {"height", map().height},
            {"truth", std::move(images)},
            {"pictures", std::move(pictures)}};
  }

 private:
  std::string path_;
  formats::Asset asset_;
  std::string hash_;
  std::vector<FootprintSet> sets_;
  std::vector<BenchQuery> queries_;  ///< of all sizes
  std::vector<SizedQueries> sized_queries_;
  std::list<SetTruth> truths_;
  int picture_pixels_;
  std::size_t picture_sizes_;
  std::vector<LitTruth> pictures_;
};

/// Measures the candidates of one map.
class MapBench {
 public:
  MapBench(Tool& tool, const BenchSettings& settings, const AssetFolder& folder, BenchMap& map)
      : tool_(tool), settings_(settings), folder_(folder), map_(map) {}

  /// A measurement: {map, name, method, setting, command, status, ...}. What fails is in its message.
  Json measure(const Candidate& candidate) {
    Json measurement = {{"map", map_.hash()},           {"name", candidate.name()},          {"method", candidate.method},
                        {"setting", candidate.setting}, {"command", commandText(candidate)}, {"status", "failed"}};
    try {
      Json figures = {{"prepare", prepare(candidate)}};
      ask(candidate, figures);
      measurement["status"] = "ok";
      measurement.update(figures);
    } catch (const std::exception& error) {
      measurement["message"] = error.what();
    }
    return measurement;
  }

 private:
  std::string assetOf(const Candidate& candidate) const {
    return candidate.tool.empty() ? map_.path() : folder_.fileOf(map_.hash(), candidate.name());
  }

  const Candidate* sourceOf(const Candidate& candidate) const {
    for (const Candidate& other : all_)
      if (other.name() == candidate.source) return &other;
    return nullptr;
  }

  std::vector<std::string> words(const Candidate& candidate) const {
    const Candidate* source = sourceOf(candidate);
    std::vector<std::string> list = {candidate.tool, source ? assetOf(*source) : map_.path(), "-o", assetOf(candidate)};
    list.insert(list.end(), candidate.flags.begin(), candidate.flags.end());
    return list;
  }

  /// A command line that a person can type, with short names of files.
  std::string commandText(const Candidate& candidate) const {
    if (candidate.tool.empty()) return "glint-query " + fs::path(map_.path()).filename().string();
    const auto file = [&](const std::string& method) { return map_.name() + "." + method + ".glint"; };
    std::string text = candidate.tool + " " +
                       (candidate.source.empty() ? fs::path(map_.path()).filename().string() : file("pyramid")) + " -o ";
    std::string method = candidate.method;
    std::replace(method.begin(), method.end(), ' ', '-');
    text += file(method);
    for (const std::string& flag : candidate.flags) text += " " + flag;
    return text;
  }

  /// Time that the asset takes from which another is made; makes it where this run has not done so.
  double sourceTime(const Candidate& candidate) {
    const Candidate* source = sourceOf(candidate);
    if (source == nullptr) return 0;
    if (!times_.contains(source->name()) && !failures_.contains(source->name())) {
      try {
        prepare(*source);
      } catch (const Error& error) {
        failures_[source->name()] = error.what();
      }
    }
    if (const auto failure = failures_.find(source->name()); failure != failures_.end())
      throw Error(ErrorCode::failed, "bench.candidate", "", "",
                  source->name() + ", which it is made from, failed: " + failure->second);
    return times_.at(source->name());
  }

  /// Makes the asset, and where it is missing the one that it is made from.
  /// @return {wall_s, cpu_s, peak_bytes, total_s}; the last with the time of the source
  Json prepare(const Candidate& candidate) {
    if (candidate.tool.empty()) return {{"wall_s", 0.0}, {"cpu_s", 0.0}, {"peak_bytes", 0}, {"total_s", 0.0}};
    const double source_s = sourceTime(candidate);
    std::vector<std::string> command = words(candidate);
    for (const char* word : {"--force", "--quiet"}) command.emplace_back(word);
    for (const std::string& flag : childFlags(tool_)) command.push_back(flag);
    const ChildRun run = runProgram(command);
    if (run.exit_code != 0) {
      const std::string message = fmt::format("exit code {}: {}", run.exit_code, run.message);
      failures_[candidate.name()] = message;
      throw Error(ErrorCode::failed, "bench.candidate", "", "", message);
    }
    times_[candidate.name()] = source_s + run.wall_s;
    return {{"wall_s", run.wall_s}, {"cpu_s", run.cpu_s}, {"peak_bytes", run.peak_bytes}, {"total_s", source_s + run.wall_s}};
  }

  void ask(const Candidate& candidate, Json& measurement) {
    api::NdfOptions options;
    options.sigma_r = kBenchSigmaR;
    if (candidate.takes_normals) options.normals = map_.path();
    const api::OpenedNdf ndf = api::OpenedNdf::open(assetOf(candidate), options);
    measurement["file_bytes"] = ndf.asset().info().file_bytes;
    measurement["times"] = Json(benchTimes(ndf, map_.queries(), map_.sizedQueries(), settings_.longest_run_s));
    measurement["errors"] = Json::array();
    measurement["images"] = Json::array();
    measurement["pictures"] = Json::array();
    if (candidate.tool.empty()) return;  // it is the truth
    for (const SetTruth& truth : map_.truths()) {
      std::vector<float> first;
      measurement["errors"].push_back(Json(truth.errorsOf(ndf, settings_.budget_s, first)));
      if (truth.set().shape == FootprintShape::round)
        measurement["images"].push_back({{"sigma_texels", truth.set().sigma_texels}, {"image", roundedImage(first)}});
    }
    const auto density = [&](const Footprint& footprint, Vec2 half) { return ndf.model().density(footprint, half); };
    for (const LitTruth& truth : map_.pictures())
      measurement["pictures"].push_back(Json(truth.errorsOf(density, ndf.info().shapes.gaussians, settings_.picture_budget_s)));
  }

  Tool& tool_;
  const BenchSettings& settings_;
  const AssetFolder& folder_;
  BenchMap& map_;
  std::vector<Candidate> all_ = benchCandidates(false);
  std::map<std::string, std::string> failures_;  ///< messages, by the names of candidates
  std::map<std::string, double> times_;          ///< of assets of this run, from the map, by the names of their candidates
};

bool isWanted(const BenchSettings& settings, const Candidate& candidate) {
  return settings.only.empty() ||
         std::find(settings.only.begin(), settings.only.end(), candidate.method) != settings.only.end();
}

}  // namespace

void runBench(Tool& tool, const BenchSettings& settings, const AssetFolder& folder, BenchResults& results) {
  std::vector<Candidate> candidates = benchCandidates(settings.quick);
  std::erase_if(candidates, [&](const Candidate& c) { return !isWanted(settings, c); });
  for (const std::string& path : settings.maps) checkKind(path);
  const bake::ProgressFn progress = tool.progress("measurements");
  const std::size_t total = settings.maps.size() * candidates.size();
  std::size_t done = 0;
  for (const std::string& path : settings.maps) {
    BenchMap map(tool, path, settings);
    MapBench bench(tool, settings, folder, map);
    if (!results.hasMap(map.hash())) {
      results.addMap(map.json());
      results.setPlainLobe(Json(plainLobeTime(map.queries())));
    }
    for (const Candidate& candidate : candidates) {
      if (!results.has(map.hash(), candidate.name())) {
        results.add(bench.measure(candidate));
        results.write(settings.output);
      }
      if (progress) progress(++done, total);
    }
    folder.finish(map.hash());
  }
  results.write(settings.output);
}

}  // namespace glint::apps
