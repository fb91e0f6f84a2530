#include <nlohmann/json.hpp>

#include "common/files.h"
#include "glint-validate/report.h"

using namespace glint;

int main(int argc, char** argv) {
  apps::Tool tool(
      {"glint-validate",
       "Checks assets against every rule of the format: structure, indices, hashes and values. Prints what is wrong "
       "and what to do; valid files are silent. Exit code 0: valid; 2: unreadable; 3: invalid; 5: unsupported.",
       "glint-validate flakes.glint --warnings-as-errors"});
  const apps::InputFiles inputs(tool, "assets (.glint)", "FILE");
  bool warnings_as_errors = false;
  bool quick = false;
  tool.flag("--warnings-as-errors", warnings_as_errors, "exit with 3 if there are warnings");
  tool.flag("--quick", quick, "check structure and indices only, not hashes and values");

  return tool.run(argc, argv, [&] {
    const formats::ValidateOptions options{.hashes = !quick, .data = !quick};
    std::vector<formats::ValidationReport> reports;
    for (const std::string& path : inputs.paths()) {
      reports.push_back(formats::validateAsset(path, options));
      tool.print(apps::reportText(reports.back()));
      if (reports.back().findings.empty()) tool.summary(path + ": valid (" + reports.back().kind + ")\n");
    }
    tool.setResult(apps::reportJson(reports));
    if (const auto code = apps::exitCode(reports, warnings_as_errors)) tool.setExitCode(*code);
  });
}
