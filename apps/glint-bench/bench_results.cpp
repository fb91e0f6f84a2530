#include "glint-bench/bench_results.h"

#include <fmt/format.h>

#include <algorithm>
#include <limits>
#include <utility>

#include "common/files.h"
#include "glint-bench/machine.h"
#include "glint-bench/result_checks.h"
#include "glint-bench/result_file.h"
#include "glint/model/error.h"
#include "measure/candidates.h"

namespace glint::apps {
namespace {

using Json = nlohmann::ordered_json;

[[noreturn]] void refuse(const std::string& path, const std::string& what) {
  throw Error(ErrorCode::invalid_input, "bench.results", path, "", what, "name another file, or start again with --force");
}

}  // namespace

BenchResults::BenchResults(const std::string& generator, std::uint64_t seed, int places, bool quick)
    : document_({{"schema", kSchema},
                 {"generator", generator},
                 {"machine", machineJson()},
                 {"seed", seed},
                 {"places", places},
                 {"quick", quick},
                 {"maps", Json::array()},
                 {"measurements", Json::array()}}) {}

BenchResults BenchResults::read(const std::string& path, const BenchResults* same) {
  BenchResults results;
  results.document_ = parseResultFile(path);
  if (results.document_.is_discarded()) refuse(path, "is no JSON document, or not whole");
  if (!results.document_.is_object() || results.document_.value("schema", Json()) != Json(kSchema))
    refuse(path, std::string("is not of the form \"") + kSchema + "\"");
  if (const std::string fault = faultOf(results.document_); !fault.empty()) refuse(path, fault);
  if (same == nullptr) return results;
  for (const char* name : {"generator", "machine", "seed", "places", "quick"}) {
    if (results.document_[name] == same->document_[name]) continue;
    throw Error(ErrorCode::usage, "bench.results", path, "",
                std::string("holds results of another ") + (std::string(name) == "generator" ? "version" : name) +
                    ", which cannot stand beside new ones",
                "name another file, or start again with --force");
  }
  return results;
}

bool BenchResults::has(const std::string& map_hash, const std::string& name) const {
  const Json& all = document_["measurements"];
  return std::any_of(all.begin(), all.end(), [&](const Json& measurement) {
    return measurement["map"] == map_hash && measurement["name"] == name && measurement["status"] == "ok";
  });
}

void BenchResults::add(Json measurement) {
  Json& all = document_["measurements"];
  std::erase_if(all.get_ref<Json::array_t&>(),
                [&](const Json& other) { return other["map"] == measurement["map"] && other["name"] == measurement["name"]; });
  all.push_back(std::move(measurement));
  const std::vector<Candidate> candidates = benchCandidates(false);
  const auto place = [&](const Json& m) {
    const std::string name = m["name"];
    const auto found = std::find_if(candidates.begin(), candidates.end(), [&](const Candidate& c) { return c.name() == name; });
    return std::pair(m["map"].get<std::string>(), found - candidates.begin());
  };
  auto& list = all.get_ref<Json::array_t&>();
  std::stable_sort(list.begin(), list.end(), [&](const Json& a, const Json& b) { return place(a) < place(b); });
}

bool BenchResults::hasMap(const std::string& hash) const {
  const Json& maps = document_["maps"];
  return std::any_of(maps.begin(), maps.end(), [&](const Json& map) { return map["hash"] == hash; });
}

void BenchResults::addMap(Json map) {
  if (!hasMap(map["hash"])) document_["maps"].push_back(std::move(map));
}

void BenchResults::write(const std::string& path) const {
  // Names of files and messages may be no UTF-8.
  writeTextFile(path, document_.dump(-1, ' ', false, Json::error_handler_t::replace) + "\n");
}

namespace {

/// Measurements of one map that did not fail.
std::vector<const Json*> finishedMeasurements(const Json& document, const Json& map) {
  std::vector<const Json*> measurements;
  for (const Json& measurement : document["measurements"])
    if (measurement["map"] == map["hash"] && measurement["status"] == "ok") measurements.push_back(&measurement);
  return measurements;
}

/// Nanoseconds of a density of round footprints of a size; infinite if it was not measured.
double densityTime(const Json& measurement, double sigma) {
  for (const Json& time : measurement["times"]["density"]["sizes"])
    if (time["sigma_texels"].get<double>() == sigma) return time["ns"].get<double>();
  return std::numeric_limits<double>::infinity();
}

std::string percentText(double error) { return error > 10 ? "> 1000" : fmt::format("{:.1f}", 100 * error); }

/// " 0.012 to 0.35": FLIP of all pictures; empty if there are none.
std::string flipText(const Json& measurement) {
  double low = 1, high = -1;
  for (const Json& picture : measurement["pictures"]) {
    if (!picture.contains("flip")) continue;
    low = std::min(low, picture["flip"].get<double>());
    high = std::max(high, picture["flip"].get<double>());
  }
  return high < 0 ? "" : fmt::format("   {:.2g} to {:.2g}", low, high);
}

/// Seen error of round footprints of a size; below 0 if there is none.
double seenAt(const Json& measurement, double sigma) {
  for (const Json& set : measurement["errors"])
    if (set["shape"] == "round" && set["sigma_texels"].get<double>() == sigma) return set["seen"].get<double>();
  return -1;
}

std::string measurementLine(const Json& measurement) {
  double low = 1e30, high = -1;
  for (const Json& set : measurement["errors"]) {
    if (set["shape"] != "round") continue;
    low = std::min(low, set["seen"].get<double>());
    high = std::max(high, set["seen"].get<double>());
  }
  const std::string seen = high < 0 ? "the truth" : percentText(low) + " to " + percentText(high) + " %";
  double quickest = std::numeric_limits<double>::infinity(), slowest = 0;
  for (const Json& time : measurement["times"]["density"]["sizes"]) {
    quickest = std::min(quickest, time["ns"].get<double>());
    slowest = std::max(slowest, time["ns"].get<double>());
  }
  return fmt::format("  {:<34} {:>8.2f} s {:>9.2f} MB {:>8.2f} to {:>9.2f} us   {:<18}{}\n",
                     measurement["name"].get<std::string>(), measurement["prepare"]["total_s"].get<double>(),
                     1e-6 * measurement["file_bytes"].get<double>(), 1e-3 * quickest, 1e-3 * slowest, seen,
                     flipText(measurement));
}

/// The quickest method within each of some errors, for one size of footprints. One that is no more than a tenth quicker than a
/// simpler one counts as equal.
std::string cheapestLine(const std::vector<const Json*>& measurements, double sigma) {
  constexpr double kClearly = 0.9;
  std::string line = fmt::format("  {:>5.0f} texels ", sigma);
  for (const double most : {0.01, 0.05, 0.1, 0.2}) {
    const Json* best = nullptr;
    for (const Json* measurement : measurements) {
      const double seen = seenAt(*measurement, sigma);
      const bool within = measurement->at("errors").empty() || (seen >= 0 && seen <= most);
      if (within && (best == nullptr || densityTime(*measurement, sigma) < kClearly * densityTime(*best, sigma)))
        best = measurement;
    }
    line += fmt::format(" {:>25}", best == nullptr ? "none" : best->at("name").get<std::string>());
  }
  return line + "\n";
}

}  // namespace

std::string benchText(const Json& document) {
  std::string text;
  for (const Json& map : document["maps"]) {
    const std::vector<const Json*> measurements = finishedMeasurements(document, map);
    text += fmt::format(
        "{}{}, {} x {} texels: time to prepare, file, density and seen error of round footprints, FLIP of pictures\n",
        text.empty() ? "" : "\n", map["name"].get<std::string>(), map["width"].get<int>(), map["height"].get<int>());
    for (const Json* measurement : measurements) text += measurementLine(*measurement);
    for (const Json& measurement : document["measurements"])
      if (measurement["map"] == map["hash"] && measurement["status"] != "ok")
        text += fmt::format("  {:<34} {}\n", measurement["name"].get<std::string>(), measurement.value("message", "failed"));
    text += fmt::format("The quickest within {:>16} {:>25} {:>25} {:>25}\n", "1 %", "5 %", "10 %", "20 %");
    for (const Json& truth : map["truth"]) text += cheapestLine(measurements, truth["sigma_texels"].get<double>());
  }
  return text;
}

}  // namespace glint::apps
