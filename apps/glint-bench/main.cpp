#include <filesystem>

#include "common/tool.h"
#include "glint-bench/bench_options.h"
#include "glint-bench/report_page.h"

using namespace glint;

int main(int argc, char** argv) {
  apps::Tool tool(
      {"glint-bench",
       "Measures every method on maps of yours: error against brute force, time, bytes and time to prepare. Shows "
       "the results as "
       "a page with charts.",
       "glint-bench flakes.glint -o results.json --quick",
       "Results are written after every measurement, one method at one setting on one map. The same command goes on where "
       "an earlier run "
       "was stopped. Then `glint-bench --report results.json -o report.html` makes the page."});
  const apps::BenchOptions options(tool);

  return tool.run(argc, argv, [&] {
    if (!options.report().empty()) {
      const apps::BenchResults results = apps::BenchResults::read(options.report(), nullptr);
      apps::writeReportPage(results.document(), options.output());
      tool.setResult({{"measurements", results.document()["measurements"].size()}});
      return;
    }
    const apps::BenchSettings& settings = options.settings();
    apps::BenchResults results(tool.generator(), tool.seed(), settings.places, settings.quick);
    if (!tool.force() && std::filesystem::exists(options.output()) && !std::filesystem::is_empty(options.output()))
      results = apps::BenchResults::read(options.output(), &results);
    const apps::AssetFolder folder(settings.assets, options.removesAssets());
    apps::runBench(tool, settings, folder, results);
    tool.setResult({{"measurements", results.document()["measurements"].size()}});
    tool.print(apps::benchText(results.document()));
  });
}
