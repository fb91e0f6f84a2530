#pragma once

#include <nlohmann/json.hpp>
#include <string>

namespace glint::apps {

/// The file of a bench: {schema, generator, machine, seed, places, plain_lobe, maps, measurements}. Every measurement is one candidate on one
/// map. docs/json/files/bench-results.schema.json describes it.
class BenchResults {
 public:
  static constexpr const char* kSchema = "glint-bench results 2";

  /// Starts anew.
  BenchResults(const std::string& generator, std::uint64_t seed, int places, bool quick);

  /// Goes on with an earlier file.
  /// @throws Error invalid_input if it is not whole or no results; usage if it was measured by another version, on another machine
  ///         or with another seed, number of places or --quick, and `same` is given
  static BenchResults read(const std::string& path, const BenchResults* same);

  /// Whether a candidate was measured on the map of this hash. One that failed is tried again.
  bool has(const std::string& map_hash, const std::string& name) const;
  /// Adds a measurement, in the place of an earlier one. They are kept in the order of benchCandidates for each map.
  void add(nlohmann::ordered_json measurement);
  /// Adds a map, unless there is one of its hash.
  void addMap(nlohmann::ordered_json map);
  /// Whether a map of this hash is there.
  bool hasMap(const std::string& hash) const;
  void setPlainLobe(nlohmann::ordered_json time) { document_["plain_lobe"] = std::move(time); }

  const nlohmann::ordered_json& document() const { return document_; }
  void write(const std::string& path) const;

 private:
  BenchResults() = default;

  nlohmann::ordered_json document_;
};

/// "map, candidate: figures" of all measurements, and for each map and size the quickest method within 1, 5, 10 and 20 % of seen error.
std::string benchText(const nlohmann::ordered_json& document);

}  // namespace glint::apps
