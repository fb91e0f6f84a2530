#include "glint-plan/map_probe.h"

#include <fmt/format.h>

#include <algorithm>
#include <bit>
#include <cmath>
#include <nlohmann/json.hpp>

#include "glint-plan/plan_candidates.h"
#include "glint-plan/probe_map.h"
#include "glint/bake/common/slopes.h"
#include "glint/bake/ingest/ingest.h"
#include "glint/bake/ingest/normal_bounds.h"
#include "glint/formats/asset_writer.h"
#include "glint/model/ndf_pyramid.h"
#include "measure/bench_times.h"

namespace glint::apps {
namespace {

constexpr int kVersion = 5;  // of the way in which probes measure: other versions' measurements are not used
constexpr double kLongestErrors_s = 3, kLongestTime_s = 0.006;
/// Larger sets of copies take longer to make than they teach: caches and tables of pages hold less.
constexpr double kMostCopied_bytes = 320e6;
constexpr int kMostCopies = 64;
/// Places after which errors are looked at: candidates that are clearly good or clearly bad are asked no more.
constexpr int kSteps[] = {8, kUsualPlaces, kQuestionPlaces};

/// Texels along an axis of a probe; 0: the map is no larger.
int edgeOf(const MapQuestion& question, const NormalMap& map) {
  constexpr int kUsual = 512, kLeast = 256;
  constexpr double kFootprintsAcross = 8, kStridesAcross = 24;  // images of fine pyramids take long
  const double stride = question.footprints.smallest / double{kFootprintPerStride};
  int edge = std::clamp(16 * static_cast<int>(kStridesAcross * stride / 16), kLeast, kUsual);
  const double wide = kFootprintsAcross * std::min(question.footprints.smallest, 1e4);
  edge = std::max(edge, static_cast<int>(std::bit_ceil(static_cast<unsigned>(wide))));
  return 2 * edge <= std::min(map.width, map.height) ? edge : 0;
}

/// A constant and a share for each texel, from two measurements: y1 at n1 texels, y2 at more.
double extrapolated(double texels, double n1, double y1, double n2, double y2) {
  const double each = std::max(0.0, (y2 - y1) / (n2 - n1)), constant = y2 - each * n2;
  return constant < 0 ? y2 * texels / n2 : constant + each * texels;
}

}  // namespace

/// A probe: a map, its assets and the exact images of its questions.
struct MapProbe::Part {
  std::optional<formats::Asset> asset;
  std::optional<AssetMaker> maker;
  std::list<PlaceTruth> truths;
  std::vector<BenchQuery> queries;  ///< that are timed
};

MapProbe::MapProbe(Tool& tool, const AssetFolder& folder, const PlanMap& map, const MapQuestion& question, ProbeCache& cache)
    : tool_(tool), folder_(folder), map_(map), question_(question), cache_(cache) {
  const NormalMap& normals = map_.normals();
  all_ = planCandidates(question_, normals.width, normals.height);
  edge_ = edgeOf(question_, normals);
  constexpr double kFootprintsAcross = 8;  // larger footprints would be most of the probe
  const double across = edge_ > 0 ? edge_ : std::min(normals.width, normals.height);
  sizes_ = question_.sizes(kQuestionSizes, std::max(question_.footprints.smallest, across / kFootprintsAcross));
}

MapProbe::~MapProbe() = default;

double MapProbe::edgeTexels(bool large) const {
  const double edge = large ? edge_ : edge_ / 2;
  return edge * edge;
}

MapProbe::Part& MapProbe::part(bool large) {
  std::unique_ptr<Part>& part = large ? large_ : small_;
  if (part) return *part;
  part = std::make_unique<Part>();
  std::string path = map_.path, label = "whole " + question_.key();
  std::vector<Candidate> all = all_;
  if (edge_ > 0) {
    const int edge = large ? edge_ : edge_ / 2;
    const ProbeMap probe = probeMap(map_.normals(), edge, tool_.seed());
    NormalMap made;
    made.width = probe.width, made.height = probe.height, made.normals = probe.normals;
    made.slopes = bake::describeNormals(probe.width, probe.height, probe.normals).slopes;
    const auto bounds = bake::buildNormalBounds(made.width, made.height, made.normals);
    bake::attachBounds(made, bounds);
    label = fmt::format("probe {} {}", edge, question_.key());
    path = folder_.fileOf(map_.hash, label);
    formats::writeAsset(path, made, tool_.provenance(), {true});
    all = planCandidates(question_, edge, edge);
  }
  part->asset = formats::Asset::open(path);
  part->maker.emplace(tool_, folder_, map_.hash, label, path, std::move(all), question_.sigma_r);
  return *part;
}

template <class Measure>
double MapProbe::kept(const std::string& key, const Measure& measure) {
  const std::string whole =
      fmt::format("{} {}, seed {}, probe {}: {}: {}", tool_.generator(), kVersion, tool_.seed(), edge_, question_.key(), key);
  if (const std::optional<double> known = cache_.find(whole)) return *known;
  const double value = measure();
  cache_.put(whole, value);
  return value;
}

Costs MapProbe::costsOf(bool large, std::size_t candidate) {
  const std::string key = fmt::format("{} {} ", large ? "large" : "small", all_[candidate].name());
  const auto made = [&]() -> const MadeAsset& { return part(large).maker->make(part(large).maker->all()[candidate]); };
  Costs costs;
  costs.bytes = kept(key + "bytes", [&] { return made().bytes; });
  costs.preparation_s = kept(key + "preparation_s", [&] { return made().seconds; });
  return costs;
}

double MapProbe::queryTime(std::size_t candidate) {
  return kept(all_[candidate].name() + " query_ns", [&] {
    Part& asked = part(true);
    const Candidate& probed = asked.maker->all()[candidate];
    if (asked.queries.empty()) asked.queries = benchQueries(asked.asset->get<NormalMap>(), tool_.seed(), kTimedQueries, sizes_);
    // Caches that hold the asset of a small map do not hold that of a large one. Copies of the small one, as many as make up the large
    // one, are missed as often.
    const double bytes = asked.maker->make(probed).bytes;
    const double times = edge_ > 0 ? static_cast<double>(map_.normals().normals.size()) / edgeTexels(true) : 1;
    const double enough = std::clamp(kMostCopied_bytes / bytes, 1.0, double{kMostCopies});
    const std::list<api::OpenedNdf> copies =
        asked.maker->openCopies(probed, static_cast<int>(std::ceil(std::min(times, enough))));
    AskedNdf ndf{{}, asked.queries};
    for (const api::OpenedNdf& copy : copies) ndf.copies.push_back(&copy);
    return densityTimes({&ndf, 1}, kLongestTime_s).front();
  });
}

Costs MapProbe::costs(std::size_t candidate) {
  Costs costs = costsOf(true, candidate);
  if (edge_ > 0) {
    const Costs other = costsOf(false, candidate);
    const double texels = static_cast<double>(map_.normals().normals.size());
    const double n1 = edgeTexels(false), n2 = edgeTexels(true);
    costs.bytes = extrapolated(texels, n1, other.bytes, n2, costs.bytes);
    costs.preparation_s = extrapolated(texels, n1, other.preparation_s, n2, costs.preparation_s);
  }
  costs.query_ns = queryTime(candidate);
  if (all_[candidate].tool.empty()) costs.bytes = map_.bytes;
  if (all_[candidate].takes_normals) costs.bytes += map_.bytes;
  costs.preparation_s += map_.ingest_s;
  return costs;
}

double MapProbe::compressionFactor(std::size_t candidate) {
  constexpr double kMost = 1.15;  // what falls shorter than this has all it can keep, on the whole map as on the crop
  const double given = toleranceOf(all_[candidate]);
  if (edge_ == 0 || given == 0) return 1;
  const double reached = kept(fmt::format("{} reached", all_[candidate].name()),
                              [&] { return part(true).maker->make(part(true).maker->all()[candidate]).reached; });
  const double factor = given / std::max(reached, 1e-9);
  return factor > kMost ? 1 : std::max(factor, 1.0);
}

PlaceErrors MapProbe::errorsOf(std::size_t candidate, std::size_t size, double tolerance) {
  std::optional<api::OpenedNdf> ndf;
  std::optional<PlaceSample> sample;
  const auto measured = [&](int places) {
    if (!sample) {
      Part& asked = part(true);
      while (asked.truths.size() <= size) {
        const std::size_t next = asked.truths.size();
        asked.truths.push_back(questionTruth(asked.asset->get<NormalMap>(), question_, tool_.seed(), next, sizes_[next]));
      }
      ndf.emplace(asked.maker->open(asked.maker->all()[candidate]));
      sample.emplace(*std::next(asked.truths.begin(), static_cast<std::ptrdiff_t>(size)), *ndf);
    }
    return sample->ask(places, kLongestErrors_s);
  };
  const double factor = compressionFactor(candidate);
  PlaceErrors errors;
  for (const int places : kSteps) {
    const std::string key = fmt::format("{} at {:.6g}, {} places: ", all_[candidate].name(), sizes_[size], places);
    errors.seen = kept(key + "seen", [&] { return measured(places).seen; });
    errors.deviation = kept(key + "deviation", [&] { return measured(places).deviation; });
    errors.bias = kept(key + "bias", [&] { return measured(places).bias; });
    errors.places = static_cast<int>(kept(key + "count", [&] { return double(measured(places).places); }));
    errors.seen *= factor, errors.deviation *= factor, errors.bias *= factor;
    if (isHopeless(errors, tolerance) || surelyWithin(errors, tolerance)) break;
  }
  return errors;
}

PlaceErrors MapProbe::errors(std::size_t candidate, double tolerance) {
  PlaceErrors largest;
  if (all_[candidate].tool.empty()) return largest;  // the texels themselves
  const auto needs = [](const PlaceErrors& e) { return std::max(surelySeen(e), e.bias / kBiasShare); };
  for (std::size_t size = 0; size < sizes_.size() && surelyWithin(largest, tolerance); ++size) {
    const PlaceErrors errors = errorsOf(candidate, size, tolerance);
    if (needs(errors) > needs(largest)) largest = errors;
  }
  if (surelyWithin(largest, tolerance)) largest.seen = std::max(largest.seen, seenBeyondProbe(candidate, tolerance));
  return largest;
}

double MapProbe::seenBeyondProbe(std::size_t candidate, double tolerance) {
  const double given = toleranceOf(all_[candidate]);
  if (given == 0 || question_.footprints.largest <= sizes_.back()) return 0;
  const auto source =
      std::find_if(all_.begin(), all_.end(), [&](const Candidate& c) { return c.name() == all_[candidate].source; });
  return std::hypot(given, errors(static_cast<std::size_t>(source - all_.begin()), tolerance).seen);
}

}  // namespace glint::apps
