#include "glint-plan/totals.h"

#include <algorithm>

namespace glint::apps {
namespace {

/// A choice for the first materials.
struct Partial {
  Share sum;
  std::vector<std::size_t> chosen;
};

bool isNoWorse(const Share& a, const Share& b) {
  return a.goal <= b.goal && a.bytes <= b.bytes && a.preparation_s <= b.preparation_s;
}

/// Leaves out choices that another one is no worse than in any sum: no choice for the other materials makes them better.
void keepBest(std::vector<Partial>& partials) {
  std::sort(partials.begin(), partials.end(), [](const Partial& a, const Partial& b) { return a.sum.goal < b.sum.goal; });
  std::vector<Partial> kept;
  for (Partial& partial : partials) {
    const bool beaten =
        std::any_of(kept.begin(), kept.end(), [&](const Partial& other) { return isNoWorse(other.sum, partial.sum); });
    if (!beaten) kept.push_back(std::move(partial));
  }
  partials = std::move(kept);
}

}  // namespace

std::optional<std::vector<std::size_t>> cheapestWithin(const std::vector<std::vector<Share>>& options, double most_bytes,
                                                       double most_preparation_s) {
  std::vector<Partial> partials(1);
  for (const std::vector<Share>& of_material : options) {
    std::vector<Partial> longer;
    for (const Partial& partial : partials) {
      for (std::size_t k = 0; k < of_material.size(); ++k) {
        Partial next = partial;
        next.sum.goal += of_material[k].goal;
        next.sum.bytes += of_material[k].bytes;
        next.sum.preparation_s += of_material[k].preparation_s;
        next.chosen.push_back(k);
        if (next.sum.bytes <= most_bytes && next.sum.preparation_s <= most_preparation_s) longer.push_back(std::move(next));
      }
    }
    keepBest(longer);
    partials = std::move(longer);
  }
  if (partials.empty()) return std::nullopt;
  return partials.front().chosen;
}

}  // namespace glint::apps
