#pragma once

#include <nlohmann/json_fwd.hpp>
#include <span>
#include <vector>

#include "glint/api/any_ndf.h"
#include "measure/workload.h"

namespace glint::apps {

/// Questions about round footprints of one size.
struct SizedQueries {
  float sigma_texels = 0;
  std::vector<BenchQuery> queries;
};

/// Nanoseconds of a question, on one thread, medians of five: {density: {cold, warm, batch, sizes}, mean: {cold}, sample: {cold}},
/// each {ns, spread}. `cold` asks many questions anywhere, of which most miss the caches of large assets; `warm` asks few of them
/// again and again; `batch` asks the cold ones in one call. `sizes` has the cold densities of each size, with its sigma_texels.
/// `spread` is the largest over the smallest of the five.
/// @param longest_s  after which a run of slow questions ends
nlohmann::json benchTimes(const api::OpenedNdf& ndf, std::span<const BenchQuery> queries, std::span<const SizedQueries> sizes,
                          double longest_s);

/// A model that is asked: question k by copy k modulo their number.
struct AskedNdf {
  std::vector<const api::OpenedNdf*> copies;
  std::span<const BenchQuery> queries;
};

/// Nanoseconds of a density of each model, processor time of one thread: they are asked in turns, and the time is the lower quartile
/// of the rounds (time_rounds.h). Questions go anywhere on the map, as those of rays without an order do.
/// @param longest_s  after which the turn of a slow model ends
std::vector<double> densityTimes(std::span<const AskedNdf> ndfs, double longest_s);

/// Nanoseconds of a plain microfacet lobe (anisotropic GGX), for comparison in the same run: {ns, spread}.
nlohmann::json plainLobeTime(std::span<const BenchQuery> queries);

}  // namespace glint::apps
