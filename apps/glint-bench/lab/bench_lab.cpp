#include "glint-bench/lab/bench_lab.h"

#include <fmt/format.h>

#include <algorithm>
#include <filesystem>
#include <numbers>

#include "common/child_process.h"
#include "glint/bake/common/slopes.h"
#include "glint/bake/ingest/normal_bounds.h"
#include "glint/formats/asset_writer.h"

namespace glint::apps {
namespace {

/// Options of the program that makes an asset: the method's own, and those that the question asks for.
std::vector<std::string> flagsOf(const Candidate& method, const LabQuestion& question) {
  std::vector<std::string> flags = method.flags;
  const auto add = [&](const char* name, const std::string& value) { flags.insert(flags.end(), {name, value}); };
  if (method.tool == "glint-pyramid") {
    add("--sigma-r", fmt::format("{:.9g}", question.sigma_r));
    if (question.surface == Surface::smooth) add("--surface", "smooth");
  }
  if (method.tool == "glint-binmap") add("--alpha", fmt::format("{:.9g}", std::numbers::sqrt2_v<float> * question.sigma_r));
  return flags;
}

std::string keyOf(const bake::SynthOptions& o) {
  return fmt::format("{} {} {} {} {} {} {} {} {} {} {}", static_cast<int>(o.kind), o.width, o.height, o.seed, o.alpha, o.gamma,
                     o.correlation_texels, o.streak_texels, o.feature_texels, o.density, o.slope);
}

const Candidate* sourceOf(const std::vector<Candidate>& all, const Candidate& method) {
  const auto found = std::find_if(all.begin(), all.end(), [&](const Candidate& c) { return c.name() == method.source; });
  return found == all.end() ? nullptr : &*found;
}

}  // namespace

std::vector<Candidate> BenchLab::methods() {
  std::vector<Candidate> chosen = benchCandidates(true);
  std::erase_if(chosen, [](const Candidate& c) { return c.tool.empty(); });
  for (const Candidate& c : benchCandidates(false))
    if (c.name() == "cp, rank 16") chosen.push_back(c);
  return chosen;
}

bake::SynthOptions BenchLab::typical(bake::SynthKind kind) const {
  bake::SynthOptions options = bake::defaultSynthOptions(kind);
  options.width = options.height = mapSize();
  options.seed = seed();
  return options;
}

const LabMap& BenchLab::map(const bake::SynthOptions& options) {
  const LabMap*& made = synthetic_[keyOf(options)];
  if (made == nullptr) made = &map(options.width, options.height, bake::synthNormals(options));
  return *made;
}

const LabMap& BenchLab::map(int width, int height, std::span<const Vec2> normals) {
  NormalMap made;
  made.width = width, made.height = height, made.normals = normals;
  made.slopes = bake::describeNormals(width, height, normals).slopes;
  const auto bounds = bake::buildNormalBounds(width, height, normals);
  bake::attachBounds(made, bounds);
  const std::string id = fmt::format("{:08x}", ++map_count_), path = folder_.fileOf(id, "map");
  formats::writeAsset(path, made, tool_.provenance(), {true});
  maps_.push_back({id, path, formats::Asset::open(path)});
  return maps_.back();
}

api::OpenedNdf BenchLab::truth(const LabMap& map, const LabQuestion& question) {
  api::NdfOptions options;
  options.sigma_r = question.sigma_r;
  options.surface = question.surface;
  return api::OpenedNdf::open(map.path, options);
}

std::string BenchLab::assetOf(const LabMap& map, const Candidate& method, const LabQuestion& question) const {
  const bool smooth = question.surface == Surface::smooth;
  return folder_.fileOf(map.id, fmt::format("{} {:.9g}{}", method.name(), question.sigma_r, smooth ? " smooth" : ""));
}

void BenchLab::make(const LabMap& map, const Candidate& method, const LabQuestion& question) {
  const std::string file = assetOf(map, method, question);
  if (made_.contains(file)) return;
  const std::vector<Candidate> all = benchCandidates(false);
  const Candidate* source = sourceOf(all, method);
  if (source != nullptr) make(map, *source, question);
  std::vector<std::string> words = {method.tool, source != nullptr ? assetOf(map, *source, question) : map.path, "-o", file};
  for (const std::string& flag : flagsOf(method, question)) words.push_back(flag);
  words.insert(words.end(), {"--force", "--quiet"});
  for (const std::string& flag : childFlags(tool_)) words.push_back(flag);
  const ChildRun run = runProgram(words);
  if (run.exit_code != 0) throw Error(ErrorCode::failed, "bench.candidate", "", "", run.message);
  made_[file] = run.wall_s;
}

double BenchLab::secondsOf(const LabMap& map, const Candidate& method, const LabQuestion& question) {
  make(map, method, question);
  return made_.at(assetOf(map, method, question));
}

double BenchLab::bytesOf(const LabMap& map, const Candidate& method, const LabQuestion& question) {
  make(map, method, question);
  return static_cast<double>(std::filesystem::file_size(assetOf(map, method, question)));
}

api::OpenedNdf BenchLab::open(const LabMap& map, const Candidate& method, const LabQuestion& question) {
  make(map, method, question);
  api::NdfOptions options;
  options.sigma_r = question.sigma_r;
  if (method.takes_normals && question.normals_below_level_0) options.normals = map.path;
  return api::OpenedNdf::open(assetOf(map, method, question), options);
}

void BenchLab::forget() {
  for (const LabMap& map : maps_) folder_.finish(map.id);
  synthetic_.clear();
  maps_.clear();
  made_.clear();
}

}  // namespace glint::apps
