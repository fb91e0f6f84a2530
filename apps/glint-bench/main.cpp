#include "glint-bench/actions.h"

using namespace glint;

int main(int argc, char** argv) {
  apps::Tool tool(
      {"glint-bench",
       "Measures every method on maps of yours: errors of NDFs and of pictures against brute force, time, bytes and time to "
       "prepare. Tests what methods do where they fail, repeats the figures of the papers, and shows results as a page with "
       "charts.",
       "glint-bench flakes.glint -o results.json --quick",
       "Results of maps are written after every measurement, one method at one setting on one map. The same command goes on "
       "where "
       "an earlier run "
       "was stopped. Then `glint-bench --report results.json -o report.html` makes the page."});
  const apps::BenchOptions options(tool);

  return tool.run(argc, argv, [&] {
    if (!options.report().empty()) return apps::showResults(tool, options);
    if (options.stability()) return apps::testStability(tool, options);
    if (!options.preset().empty()) return apps::repeatPaper(tool, options);
    apps::measureMaps(tool, options);
  });
}
