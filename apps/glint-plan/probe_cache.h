#pragma once

#include <nlohmann/json.hpp>
#include <optional>
#include <string>

namespace glint::apps {

/// Measurements of a map, kept in a file of the map's hash from one run to the next. A file that is no such thing is taken for empty.
class ProbeCache {
 public:
  /// @param folder  made if it is missing; empty: measurements are forgotten
  /// @throws Error io if the folder cannot be made
  ProbeCache(const std::string& folder, const std::string& map_hash);
  ProbeCache(const ProbeCache&) = delete;
  ProbeCache& operator=(const ProbeCache&) = delete;

  std::optional<double> find(const std::string& key) const;
  void put(const std::string& key, double value);
  /// Writes what is new.
  void save();

 private:
  std::string file_;
  nlohmann::json values_ = nlohmann::json::object();
  bool changed_ = false;
};

}  // namespace glint::apps
