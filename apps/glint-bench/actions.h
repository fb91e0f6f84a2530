#pragma once

#include "common/tool.h"
#include "glint-bench/bench_options.h"

namespace glint::apps {

/// Shows results of any form as a page.
void showResults(Tool& tool, const BenchOptions& options);
/// Runs the tests of stability.
void testStability(Tool& tool, const BenchOptions& options);
/// Repeats the tables and plots of a paper.
void repeatPaper(Tool& tool, const BenchOptions& options);
/// Measures methods on maps, or goes on with measurements.
void measureMaps(Tool& tool, const BenchOptions& options);

}  // namespace glint::apps
