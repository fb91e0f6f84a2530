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
#include "measure/place_errors.h"

namespace glint::apps {

/// What a candidate costs.
struct Costs {
  double bytes = 0;          ///< of all files that queries need
  double preparation_s = 0;  ///< from the image
  double query_ns = 0;       ///< of a density on one thread, mean over the sizes that are asked
};

/// Deviations of a seen error that a plan keeps free below the tolerance: other places than the probed ones, and those of a check,
/// err differently, and 2 deviations hold for 49 of 50 when errors are spread evenly.
inline constexpr double kSureDeviations = 2;
/// Share of a tolerance that may be bias, which the eye does not average over places.
inline constexpr double kBiasShare = 1.0 / 3;

/// Places that tell their own deviation. Fewer ones miss the few places that err most.
inline constexpr int kUsualPlaces = 24;

/// The seen error that other places will hardly exceed.
inline double surelySeen(const PlaceErrors& errors) {
  constexpr double kFewPlaces = 2;  // deviations of few places are taken so many times
  return errors.seen + (errors.places < kUsualPlaces ? kFewPlaces : 1) * kSureDeviations * errors.deviation;
}

/// Whether errors are within a tolerance at other places, too.
inline bool surelyWithin(const PlaceErrors& errors, double tolerance) {
  return surelySeen(errors) <= tolerance && errors.bias <= kBiasShare * tolerance;
}

/// Whether more places do not bring an error back to a tolerance.
inline bool isHopeless(const PlaceErrors& errors, double tolerance) {
  constexpr double kDeviations = 4;
  return errors.seen - kDeviations * errors.deviation > tolerance;
}

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

  /// Errors at the size of the question that leaves least of the tolerance. Measuring ends at the first size whose errors are not
  /// surely within it.
  /// @throws Error failed if the candidate cannot be made
  PlaceErrors errors(std::size_t candidate, double tolerance);

  /// Texels of the larger probe along an axis; 0: the map is so small that it is the probe.
  int edge() const { return edge_; }

 private:
  struct Part;
  Part& part(bool large);
  /// Bytes and time to prepare, of a probe.
  Costs costsOf(bool large, std::size_t candidate);
  /// Nanoseconds of a density of the whole map.
  double queryTime(std::size_t candidate);
  PlaceErrors errorsOf(std::size_t candidate, std::size_t size, double tolerance);
  /// How many times as large errors of a compression are on the whole map: it has more blocks there to choose from, and comes nearer
  /// to the tolerance that it was given.
  double compressionFactor(std::size_t candidate);
  /// Seen error of a compression at footprints that are too large for the probe; 0: there are none. On the whole map every level errs
  /// as its tolerance allows, beside what its pyramid errs between images.
  double seenBeyondProbe(std::size_t candidate, double tolerance);
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
