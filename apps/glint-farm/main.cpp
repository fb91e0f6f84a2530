#include "common/commands.h"
#include "common/tool.h"
#include "glint-farm/plan_command.h"
#include "glint-farm/run_command.h"
#include "glint-farm/status_command.h"

using namespace glint;

namespace {
/// Runs one command: a tool with its options.
template <class Command>
int work(int argc, char** argv) {
  apps::Tool tool(Command::info());
  Command command(tool);
  return tool.run(argc, argv, [&] { command.run(); });
}

/// Without a command there is only help.
int nothing(int argc, char** argv) {
  apps::Tool tool(
      {"glint-farm",
       "Makes the assets of thousands of maps: plan writes down what to make, run makes it, status says how far it is.",
       "glint-farm plan textures -o farm.json --make pyramid && glint-farm run farm.json",
       "Each command has a help of its own:\n"
       "  glint-farm plan FOLDER ...     which assets to make of which maps\n"
       "  glint-farm run MANIFEST ...    make what is missing\n"
       "  glint-farm status MANIFEST     what is made"});
  return tool.run(argc, argv, [] {
    throw Error(ErrorCode::usage, "cli.usage", "", "", "the command is missing",
                "give plan, run or status; see glint-farm --help");
  });
}
}  // namespace

int main(int argc, char** argv) {
  using namespace apps;
  return runCommand(argc, argv,
                    {{"plan", work<FarmPlanCommand>}, {"run", work<FarmRunCommand>}, {"status", work<FarmStatusCommand>}},
                    nothing);
}
