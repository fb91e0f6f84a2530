#include "glint-bench/bench_results.h"

#include <fmt/format.h>
#include <sys/utsname.h>

#include <array>
#include <fstream>
#include <limits>
#include <thread>

#include "common/files.h"
#include "glint/model/error.h"

namespace glint::apps {
namespace {

using Json = nlohmann::ordered_json;

std::string processorName() {
  std::ifstream info("/proc/cpuinfo");
  for (std::string line; std::getline(info, line);) {
    const std::size_t colon = line.find(": ");
    if (line.starts_with("model name") && colon != std::string::npos) return line.substr(colon + 2);
  }
  return "unknown";
}

Json machine() {
  utsname system{};
  ::uname(&system);
  return {{"processor", processorName()},
          {"cores", std::thread::hardware_concurrency()},
          {"system", std::string(system.sysname) + " " + system.release + " " + system.machine}};
}

[[noreturn]] void refuse(const std::string& path, const std::string& what) {
  throw Error(ErrorCode::invalid_input, "bench.results", path, "", what, "name another file, or start again with --force");
}

/// Whether a document has the members that the rest reads.
bool isWhole(const Json& document) {
  if (!document.is_object()) return false;
  for (const char* name : {"generator", "machine", "seed", "places", "maps", "cells"})
    if (!document.contains(name)) return false;
  const auto named = [](const Json& list, std::initializer_list<const char*> names) {
    if (!list.is_array()) return false;
    for (const Json& item : list)
      for (const char* name : names)
        if (!item.is_object() || !item.contains(name) || !item[name].is_string()) return false;
    return true;
  };
  return named(document["maps"], {"name", "hash"}) && named(document["cells"], {"map", "name", "method", "status"});
}

}  // namespace

BenchResults::BenchResults(const std::string& generator, std::uint64_t seed, int places)
    : document_({{"schema", kSchema},
                 {"generator", generator},
                 {"machine", machine()},
                 {"seed", seed},
                 {"places", places},
                 {"maps", Json::array()},
                 {"cells", Json::array()}}) {}

BenchResults BenchResults::read(const std::string& path, const BenchResults* same) {
  const std::vector<std::byte> bytes = readFile(path);
  BenchResults results;
  const auto* text = reinterpret_cast<const char*>(bytes.data());
  results.document_ = Json::parse(text, text + bytes.size(), nullptr, false);
  if (results.document_.is_discarded()) refuse(path, "is no JSON document, or not whole");
  if (!results.document_.is_object() || results.document_.value("schema", Json()) != Json(kSchema))
    refuse(path, std::string("is not of the form \"") + kSchema + "\"");
  if (!isWhole(results.document_)) refuse(path, "lacks a part of a bench's results");
  if (same == nullptr) return results;
  for (const char* name : {"generator", "machine", "seed", "places"}) {
    if (results.document_[name] == same->document_[name]) continue;
    throw Error(ErrorCode::usage, "bench.results", path, "",
                std::string("holds results of another ") + (std::string(name) == "generator" ? "version" : name) +
                    ", which cannot stand beside new ones",
                "name another file, or start again with --force");
  }
  return results;
}

const Json* BenchResults::find(const std::string& map_hash, const std::string& name) const {
  for (const Json& cell : document_["cells"])
    if (cell["map"] == map_hash && cell["name"] == name) return &cell;
  return nullptr;
}

bool BenchResults::has(const std::string& map_hash, const std::string& name) const { return find(map_hash, name) != nullptr; }

void BenchResults::add(Json cell) {
  for (Json& other : document_["cells"]) {
    if (other["map"] != cell["map"] || other["name"] != cell["name"]) continue;
    other = std::move(cell);
    return;
  }
  document_["cells"].push_back(std::move(cell));
}

bool BenchResults::hasMap(const std::string& hash) const {
  for (const Json& map : document_["maps"])
    if (map["hash"] == hash) return true;
  return false;
}

void BenchResults::addMap(Json map) {
  if (!hasMap(map["hash"])) document_["maps"].push_back(std::move(map));
}

void BenchResults::write(const std::string& path) const { writeTextFile(path, document_.dump() + "\n"); }

namespace {

/// Cells of one map that were measured.
std::vector<const Json*> measuredCells(const Json& document, const Json& map) {
  std::vector<const Json*> cells;
  for (const Json& cell : document["cells"])
    if (cell["map"] == map["hash"] && cell["status"] == "ok") cells.push_back(&cell);
  return cells;
}

/// Nanoseconds of a density of round footprints of a size; infinite if it was not measured.
double densityTime(const Json& cell, double sigma) {
  for (const Json& time : cell["times"]["density"]["sizes"])
    if (time["sigma_texels"].get<double>() == sigma) return time["ns"].get<double>();
  return std::numeric_limits<double>::infinity();
}

std::string percentText(double error) { return error > 10 ? "> 1000" : fmt::format("{:.1f}", 100 * error); }

/// Seen error of round footprints of a size; below 0 if there is none.
double seenAt(const Json& cell, double sigma) {
  for (const Json& set : cell["errors"])
    if (set["shape"] == "round" && set["sigma_texels"].get<double>() == sigma) return set["seen"].get<double>();
  return -1;
}

std::string cellLine(const Json& cell) {
  double low = 1e30, high = -1;
  for (const Json& set : cell["errors"]) {
    if (set["shape"] != "round") continue;
    low = std::min(low, set["seen"].get<double>());
    high = std::max(high, set["seen"].get<double>());
  }
  const std::string seen = high < 0 ? "the truth" : percentText(low) + " to " + percentText(high) + " %";
  double quickest = std::numeric_limits<double>::infinity(), slowest = 0;
  for (const Json& time : cell["times"]["density"]["sizes"]) {
    quickest = std::min(quickest, time["ns"].get<double>());
    slowest = std::max(slowest, time["ns"].get<double>());
  }
  return fmt::format("  {:<34} {:>8.2f} s {:>9.2f} MB {:>8.2f} to {:>9.2f} us   {}\n", cell["name"].get<std::string>(),
                     cell["prepare"]["total_s"].get<double>(), 1e-6 * cell["file_bytes"].get<double>(), 1e-3 * quickest,
                     1e-3 * slowest, seen);
}

/// The quickest method within each of some errors, for one size of footprints. One that is no more than a tenth quicker than a
/// simpler one counts as equal.
std::string cheapestLine(const std::vector<const Json*>& cells, double sigma) {
  constexpr double kClearly = 0.9;
  std::string line = fmt::format("  {:>5.0f} texels ", sigma);
  for (const double most : {0.01, 0.05, 0.1, 0.2}) {
    const Json* best = nullptr;
    for (const Json* cell : cells) {
      const double seen = seenAt(*cell, sigma);
      const bool within = cell->at("errors").empty() || (seen >= 0 && seen <= most);
      if (within && (best == nullptr || densityTime(*cell, sigma) < kClearly * densityTime(*best, sigma))) best = cell;
    }
    line += fmt::format(" {:>25}", best == nullptr ? "none" : best->at("name").get<std::string>());
  }
  return line + "\n";
}

}  // namespace

std::string benchText(const Json& document) {
  std::string text;
  for (const Json& map : document["maps"]) {
    const std::vector<const Json*> cells = measuredCells(document, map);
    text += fmt::format("{}{}, {} x {} texels: time to prepare, file, density and seen error of round footprints\n",
                        text.empty() ? "" : "\n", map["name"].get<std::string>(), map["width"].get<int>(),
                        map["height"].get<int>());
    for (const Json* cell : cells) text += cellLine(*cell);
    for (const Json& cell : document["cells"])
      if (cell["map"] == map["hash"] && cell["status"] != "ok")
        text += fmt::format("  {:<34} {}\n", cell["name"].get<std::string>(), cell.value("message", "failed"));
    text += fmt::format("The quickest within {:>16} {:>25} {:>25} {:>25}\n", "1 %", "5 %", "10 %", "20 %");
    for (const Json& truth : map["truth"]) text += cheapestLine(cells, truth["sigma_texels"].get<double>());
  }
  return text;
}

}  // namespace glint::apps
