#include <nlohmann/json.hpp>

#include "glint-validate/report.h"
#include "glint-validate/validate_options.h"

using namespace glint;

int main(int argc, char** argv) {
  apps::Tool tool(
      {"glint-validate",
       "Checks assets against every rule of the format: structure, indices, hashes and values. Prints what is wrong "
       "and what to do; valid files are silent. Exit code 0: valid; 2: unreadable; 3: invalid; 5: unsupported.",
       "glint-validate flakes.glint --warnings-as-errors"});
  const apps::ValidateOptions options(tool);

  return tool.run(argc, argv, [&] {
    std::vector<formats::ValidationReport> reports;
    for (const std::string& path : options.files()) {
      reports.push_back(formats::validateAsset(path, options.values()));
      tool.print(apps::reportText(reports.back()));
      if (reports.back().findings.empty()) tool.summary(path + ": valid (" + reports.back().kind + ")\n");
    }
    options.write(reports);
    tool.setResult(apps::reportJson(reports));
    if (const auto code = apps::exitCode(reports, options.warningsAsErrors())) tool.setExitCode(*code);
  });
}
