#pragma once

#include <functional>
#include <vector>

#include "glint-farm/entry_maker.h"
#include "glint-farm/run_report.h"

namespace glint::apps {

/// How a farm works.
struct FarmOptions {
  int jobs = 1;     ///< programs at once
  int retries = 0;  ///< further tries of an entry
  std::function<bool()> stopped;
};

/// Makes those of some entries that are not known.
/// @throws Error io if records or the log cannot be written; no program runs then
void runFarm(const Manifest& manifest, const std::vector<std::size_t>& entries, EntryMaker& maker, RunReport& report,
             const FarmOptions& options);

}  // namespace glint::apps
