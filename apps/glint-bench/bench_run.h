#pragma once

#include <string>
#include <vector>

#include "common/tool.h"
#include "glint-bench/bench_results.h"
#include "measure/asset_folder.h"

namespace glint::apps {

/// How to measure.
struct BenchSettings {
  std::vector<std::string> maps;  ///< assets of kind normals
  std::vector<std::string> only;  ///< methods; empty: all
  bool quick = false;
  int places = 12;                ///< footprints of a set
  double budget_s = 1.5;          ///< for the errors of a set
  double longest_run_s = 0.05;    ///< of one of the five runs of a time
  double picture_budget_s = 5;    ///< for a lit picture of a method
  int picture_pixels = 96;        ///< of a lit picture along each axis
  std::size_t picture_sizes = 4;  ///< sizes of lit pictures at most, from the smallest on
  std::string assets;             ///< folder for the assets
  std::string output;             ///< file of the results, which is written after every measurement
};

/// Makes every measurement that the results do not have.
void runBench(Tool& tool, const BenchSettings& settings, const AssetFolder& folder, BenchResults& results);

}  // namespace glint::apps
