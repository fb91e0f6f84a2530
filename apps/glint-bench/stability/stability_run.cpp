#include "glint-bench/stability/stability_run.h"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <map>

#include "glint-bench/lab/bench_lab.h"
#include "glint-bench/result_file.h"
#include "glint-bench/stability/stability_test.h"

namespace glint::apps {

using Json = nlohmann::ordered_json;

std::vector<StabilityTest> stabilityTests() {
  std::vector<StabilityTest> all;
  for (const auto& group : {motionTests(), footprintTests(), surfaceTests(), compressionTests(), lightTests(), reliefTests()})
    all.insert(all.end(), group.begin(), group.end());
  return all;
}

void addEach(StabilityCurves& curves, BenchLab& lab, const std::vector<Candidate>& methods, const LabMap& map,
             const LabQuestion& question, const std::function<double(const api::OpenedNdf&)>& value) {
  for (const Candidate& method : methods) {
    try {
      curves.add(method.name(), value(lab.open(map, method, question)));
    } catch (const std::exception& error) {
      curves.fail(method.name(), error.what());
    }
  }
}

std::vector<std::string> stabilityNames() {
  std::vector<std::string> names;
  for (const StabilityTest& test : stabilityTests()) names.push_back(test.name);
  return names;
}

namespace {

/// Six digits: results of other compilers differ in the last ones of a float.
double rounded(double value) { return std::stod(fmt::format("{:.6g}", value)); }

Json jsonOf(const StabilityTest& test, const StabilityCurves& curves) {
  Json points = Json::array();
  for (const StabilityCurves::Point& p : curves.points()) {
    Json point = {{"series", p.series}, {"x", p.x}};
    if (p.message.empty() && std::isfinite(p.value))
      point["value"] = rounded(p.value);
    else
      point["message"] = p.message.empty() ? "is no number" : p.message;
    points.push_back(std::move(point));
  }
  return {{"name", test.name},     {"title", test.title},         {"question", test.question}, {"axis", test.axis},
          {"figure", test.figure}, {"tolerable", test.tolerable}, {"instead", test.instead},   {"points", std::move(points)}};
}

/// Reads all that the text and the page read.
void readAll(const Json& document) {
  document.at("generator").get<std::string>();
  (void)document.at("seed"), (void)document.at("quick");
  for (const Json& test : document.at("tests")) {
    for (const char* name : {"name", "title", "question", "axis", "figure", "instead"}) test.at(name).get<std::string>();
    test.at("tolerable").get<double>();
    for (const Json& point : test.at("points")) {
      point.at("series").get<std::string>();
      point.at("x").get<double>();
      if (!point.contains("message")) point.at("value").get<double>();
    }
  }
}

}  // namespace

Json runStability(Tool& tool, const AssetFolder& folder, const std::vector<std::string>& only, bool quick) {
  std::vector<StabilityTest> tests = stabilityTests();
  std::erase_if(tests, [&](const StabilityTest& test) {
    return !only.empty() && std::find(only.begin(), only.end(), test.name) == only.end();
  });
  std::size_t total = 0, done = 0;
  for (const StabilityTest& test : tests) total += (quick ? test.quick_values : test.values).size();
  const bake::ProgressFn progress = tool.progress("points of tests");
  Json results = {{"schema", kStabilitySchema},
                  {"generator", tool.generator()},
                  {"seed", tool.seed()},
                  {"quick", quick},
                  {"tests", Json::array()}};
  for (const StabilityTest& test : tests) {
    StabilityCurves curves;
    BenchLab lab(tool, folder, quick);
    for (const double x : quick ? test.quick_values : test.values) {
      curves.at(x);
      try {
        test.measure(lab, x, curves);
      } catch (const std::exception& error) {
        curves.fail(test.name, error.what());
      }
      if (progress) progress(++done, total);
    }
    lab.forget();
    results["tests"].push_back(jsonOf(test, curves));
  }
  return results;
}

std::optional<Json> readStability(const std::string& path) {
  return readResultFile(path, kStabilitySchema, "tests of stability", "glint-bench --stability", readAll);
}

std::string stabilityText(const Json& results) {
  std::string text;
  for (const Json& test : results["tests"]) {
    text += fmt::format("{} ({}): {} up to {:.3g} holds\n", test["title"].get<std::string>(), test["name"].get<std::string>(),
                        test["figure"].get<std::string>(), test["tolerable"].get<double>());
    std::vector<std::string> order;
    std::map<std::string, std::string> cells;
    for (const Json& point : test["points"]) {
      const std::string series = point["series"];
      if (!cells.contains(series)) order.push_back(series);
      const double x = point["x"];
      if (!point.contains("value")) {
        cells[series] += fmt::format("  {:.4g}: failed", x);
        continue;
      }
      const double value = point["value"];
      cells[series] += fmt::format("  {:.4g}: {:.3g}{}", x, value, value > test["tolerable"].get<double>() ? "!" : "");
    }
    for (const std::string& series : order) text += fmt::format("  {:<32}{}\n", series, cells[series]);
  }
  return text;
}

}  // namespace glint::apps
