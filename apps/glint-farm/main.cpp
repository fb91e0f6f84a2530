#include "common/commands.h"
#include "common/tool.h"
#include "glint-farm/plan_command.h"
#include "glint-farm/run_command.h"
#include "glint-farm/status_command.h"

using namespace glint;

namespace {
/// Runs one command: a tool with its options.
template <class Command>
int work(const apps::ToolInfo& info, int argc, char** argv) {
  apps::Tool tool(info);
  Command command(tool);
  return tool.run(argc, argv, [&] { command.run(); });
}

int plan(int argc, char** argv) {
  return work<apps::FarmPlanCommand>(
      {"glint-farm plan",
       "Writes down which assets to make of which maps, each once. Maps of the same bytes share their assets.",
       "glint-farm plan textures -o farm.json --make 'normals --convention directx' --make 'pyramid --stride 8' --make cp",
       "Kinds and the flags that they have by default are those of pipelines/glint.mk; a kind that another is made of comes "
       "with it. "
       "In flags, % stands for the name of the map without its ending, as in --make 'displaced --base-color colours/%.png'."},
      argc, argv);
}

int run(int argc, char** argv) {
  return work<apps::FarmRunCommand>({"glint-farm run",
                                     "Makes the assets of a manifest that are missing, changed or damaged. Several may run on "
                                     "one manifest at once, on one machine or "
                                     "on many that see its folder. To go on after an interruption, run it again.",
                                     "glint-farm run farm.json --jobs 4"},
                                    argc, argv);
}

int status(int argc, char** argv) {
  return work<apps::FarmStatusCommand>(
      {"glint-farm status", "Says how many assets of a manifest are made, and why others are not.",
       "glint-farm status farm.json"},
      argc, argv);
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
  return apps::runCommand(argc, argv, {{"plan", plan}, {"run", run}, {"status", status}}, nothing);
}
