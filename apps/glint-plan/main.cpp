#include "glint-plan/actions.h"

using namespace glint;

int main(int argc, char** argv) {
  apps::Tool tool(
      {"glint-plan",
       "Chooses for every map of a scene the cheapest method and settings that meet the scene's tolerance within its "
       "budgets, from a quick measurement of the map. Leaves out what the scene never asks for.",
       "glint-plan scene.json --maps textures -o plan.json --make plan.mk",
       "The cheapest plan has the fewest bytes, unless the scene says \"minimise\": \"query_ns\" or \"preparation_s\". "
       "Errors are seen errors (docs/GLOSSARY.md). `glint-plan --check plan.json` builds the plan and measures it."});
  const apps::PlanOptions options(tool);

  return tool.run(argc, argv, [&] {
    if (!options.check().empty()) return apps::checkScene(tool, options);
    apps::planScene(tool, options);
  });
}
