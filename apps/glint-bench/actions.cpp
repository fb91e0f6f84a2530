#include "glint-bench/actions.h"

#include <filesystem>

#include "common/files.h"
#include "glint-bench/presets/preset_run.h"
#include "glint-bench/report_page.h"
#include "glint-bench/stability/stability_run.h"

namespace glint::apps {
namespace {

/// Writes results, and says how many parts of a name they have.
void finish(Tool& tool, const BenchOptions& options, const nlohmann::ordered_json& results, const char* parts,
            const std::string& text) {
  writeTextFile(options.output(), results.dump(1) + "\n");
  tool.setResult({{parts, results[parts].size()}});
  tool.print(text);
}

}  // namespace

void showResults(Tool& tool, const BenchOptions& options) {
  const auto show = [&](const nlohmann::ordered_json& document, ResultForm form, const char* parts) {
    writeReportPage(document, form, options.output());
    tool.setResult({{parts, document[parts].size()}});
  };
  if (const auto stability = readStability(options.report())) return show(*stability, ResultForm::stability, "tests");
  if (const auto preset = readPreset(options.report())) return show(*preset, ResultForm::preset, "rows");
  show(BenchResults::read(options.report(), nullptr).document(), ResultForm::measurements, "measurements");
}

void testStability(Tool& tool, const BenchOptions& options) {
  const BenchSettings& settings = options.settings();
  const AssetFolder folder(settings.assets, options.removesAssets());
  const auto results = runStability(tool, folder, settings.only, settings.quick);
  finish(tool, options, results, "tests", stabilityText(results));
}

void repeatPaper(Tool& tool, const BenchOptions& options) {
  const AssetFolder folder(options.settings().assets, options.removesAssets());
  const auto results = runPreset(tool, folder, options.preset(), options.settings().quick);
  finish(tool, options, results, "rows", presetText(results));
}

void measureMaps(Tool& tool, const BenchOptions& options) {
  const BenchSettings& settings = options.settings();
  BenchResults results(tool.generator(), tool.seed(), settings.places, settings.quick);
  if (!tool.force() && std::filesystem::exists(options.output()) && !std::filesystem::is_empty(options.output()))
    results = BenchResults::read(options.output(), &results);
  const AssetFolder folder(settings.assets, options.removesAssets());
  runBench(tool, settings, folder, results);
  tool.setResult({{"measurements", results.document()["measurements"].size()}});
  tool.print(benchText(results.document()));
}

}  // namespace glint::apps
