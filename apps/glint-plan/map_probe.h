#pragma once

#include <list>
#include <map>
#include <memory>
#include <optional>
#include <string>
#include <vector>

#include "glint-plan/asset_maker.h"
#include "glint-plan/plan_map.h"
#include "glint-plan/probe_cache.h"
#include "glint-plan/question.h"
#include "measure/bench_errors.h"

namespace glint::apps {

/// What a candidate costs.
struct Costs {
  double bytes = 0;          ///< of all files that queries need
  double preparation_s = 0;  ///< from the image
  double query_ns = 0;       ///< of a density on one thread, mean over the sizes that are asked
};

/// Measures candidates on small maps that stand for a large one, and predicts what they cost and err on it.
class MapProbe {
 public:
  /// @param map, cache, folder  must outlive this object
  MapProbe(Tool& tool, const AssetFolder& folder, const PlanMap& map, const MapQuestion& question, ProbeCache& cache);
  ~MapProbe();

  /// Candidates of the map itself.
  const std::vector<Candidate>& candidates() const { return all_; }

  /// Predicted costs: a constant and a share for each texel, from probes of two sizes.
  /// @throws Error failed if the candidate cannot be made
  Costs costs(std::size_t candidate);

  /// Largest seen error over the sizes of the question. Measuring ends at the first size whose error is over `enough`, and then the
  /// error is that or more.
  /// @throws Error failed if the candidate cannot be made
  double seen(std::size_t candidate, double enough);

  /// Texels of the larger probe along an axis; 0: the map is so small that it is the probe.
  int edge() const { return edge_; }

 private:
  struct Part;
  Part& part(bool large);
  Costs costsOf(bool large, std::size_t candidate);
  double seenOf(std::size_t candidate, std::size_t size);
  /// The value of a key in the cache, or that of a measurement.
  template <class Measure>
  double kept(const std::string& key, const Measure& measure);
  double edgeTexels(bool large) const;

  Tool& tool_;
  const AssetFolder& folder_;
  const PlanMap& map_;
  MapQuestion question_;
  ProbeCache& cache_;
  std::vector<Candidate> all_;
  int edge_ = 0;
  std::vector<float> sizes_;
  std::unique_ptr<Part> large_, small_;
};

}  // namespace glint::apps
