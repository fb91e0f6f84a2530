#include "glint-bench/presets/preset_run.h"

#include <fmt/format.h>

#include <algorithm>

#include "glint-bench/machine.h"
#include "glint-bench/presets/preset.h"
#include "glint-bench/result_file.h"

namespace glint::apps {

using Json = nlohmann::ordered_json;

std::vector<Preset> presets() { return {gamboa2018(), wu2019(), atanasov2021(), deng2022(), xing2024()}; }

std::vector<std::string> presetNames() {
  std::vector<std::string> names;
  for (const Preset& preset : presets()) names.push_back(preset.name);
  return names;
}

const LabMap& PresetRun::map(bake::SynthKind kind, int texels) const {
  bake::SynthOptions options = bake::defaultSynthOptions(kind);
  options.width = options.height = texels, options.seed = lab.seed();
  return lab.map(options);
}

namespace {

Json jsonOf(const PresetRow& row) {
  Json json = {{"source", row.source}, {"subject", row.subject}, {"figure", row.figure}, {"unit", row.unit}};
  if (row.paper) json["paper"] = *row.paper;
  if (row.ours) json["ours"] = std::stod(fmt::format("{:.6g}", *row.ours));
  if (!row.note.empty()) json["note"] = row.note;
  return json;
}

/// Reads all that the text and the page read.
void readAll(const Json& document) {
  for (const char* name : {"generator", "preset", "paper"}) document.at(name).get<std::string>();
  for (const char* name : {"machine", "seed", "quick"}) (void)document.at(name);
  for (const Json& row : document.at("rows")) {
    for (const char* name : {"source", "subject", "figure", "unit"}) row.at(name).get<std::string>();
    for (const char* name : {"paper", "ours"})
      if (row.contains(name)) row.at(name).get<double>();
    if (!row.contains("ours")) row.at("note").get<std::string>();
  }
}

}  // namespace

Json runPreset(Tool& tool, const AssetFolder& folder, const std::string& name, bool quick) {
  const std::vector<Preset> all = presets();
  const Preset& preset = *std::find_if(all.begin(), all.end(), [&](const Preset& p) { return p.name == name; });
  BenchLab lab(tool, folder, quick);
  std::vector<PresetRow> rows;
  PresetRun run{tool, lab, quick, rows};
  const bake::ProgressFn progress = tool.progress("tables and plots");
  std::size_t done = 0;
  for (const auto& step : preset.steps) {
    try {
      step(run);
    } catch (const std::exception& error) {
      rows.push_back({"", "a table or plot", "the rest of its rows", "", {}, {}, std::string("failed: ") + error.what()});
    }
    lab.forget();
    if (progress) progress(++done, preset.steps.size());
  }
  Json results = {
      {"schema", kPresetSchema}, {"generator", tool.generator()}, {"machine", machineJson()}, {"seed", tool.seed()},
      {"quick", quick},          {"preset", preset.name},         {"paper", preset.paper},    {"rows", Json::array()}};
  for (const PresetRow& row : rows) results["rows"].push_back(jsonOf(row));
  return results;
}

std::optional<Json> readPreset(const std::string& path) {
  return readResultFile(path, kPresetSchema, "a preset", "glint-bench --preset", readAll);
}

std::string presetText(const Json& results) {
  std::string text = results["paper"].get<std::string>() + "\n";
  const auto number = [](const Json& row, const char* name) {
    return row.contains(name) ? fmt::format("{:.4g}", row[name].get<double>()) : std::string("-");
  };
  for (const Json& row : results["rows"]) {
    const std::string figure =
        row["figure"].get<std::string>() + (row["unit"] == "" ? "" : ", " + row["unit"].get<std::string>());
    std::string ratio;
    if (row.contains("paper") && row.contains("ours") && row["paper"].get<double>() > 0)
      ratio = fmt::format("x{:.3g}", row["ours"].get<double>() / row["paper"].get<double>());
    text += fmt::format("{:<18} {:<52} {:<46} paper {:>8}  ours {:>8}  {:<8} {}\n", row["source"].get<std::string>(),
                        row["subject"].get<std::string>(), figure, number(row, "paper"), number(row, "ours"), ratio,
                        row.value("note", std::string()));
  }
  return text;
}

}  // namespace glint::apps
