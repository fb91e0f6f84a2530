#include "common/commands.h"
#include "common/tool.h"
#include "glint-query/distribution_command.h"
#include "glint-query/light_command.h"
#include "glint-query/plane_command.h"
#include "glint-query/reflectance_command.h"

using namespace glint;

namespace {
/// Runs one command: a tool with the options of one sort of questions.
template <class Command>
int ask(const apps::ToolInfo& info, int argc, char** argv) {
  apps::Tool tool(info);
  Command command(tool);
  return tool.run(argc, argv, [&] { command.run(); });
}

int askDistribution(int argc, char** argv) {
  return ask<apps::DistributionCommand>(
      {"glint-query",
       "Asks an asset how the normals inside a footprint are distributed: the density towards a half vector, its mean over "
       "a range of them, or a picture of the whole distribution.",
       "glint-query flakes.pyramid.glint --uv 0.3 0.7 --sigma 20 --half 0.1 -0.05",
       "Other questions are commands of their own, each with a help of its own:\n"
       "  glint-query light ASSET ...        light that a footprint reflects, by a table of glint-shlobes\n"
       "  glint-query reflectance ASSET ...  light that a displacement of glint-displace reflects\n"
       "  glint-query plane ASSET ...        an endless plane of tiles of glint-wang"},
      argc, argv);
}

int askLight(int argc, char** argv) {
  return ask<apps::LightCommand>(
      {"glint-query light",
       "Asks how much light a footprint reflects of a whole environment: the normals inside it, and a table of the light "
       "that glint-shlobes --light makes.",
       "glint-query light flakes.sat.glint --light studio.glint --uv 0.3 0.7 --sigma 20 --wo 0 0 1"},
      argc, argv);
}

int askReflectance(int argc, char** argv) {
  return ask<apps::ReflectanceCommand>(
      {"glint-query reflectance",
       "Asks how much light a displacement reflects between directions, or how the normals of its lobes are distributed.",
       "glint-query reflectance rock.displaced.glint --uv 0.3 0.7 --sigma 8 --wi 0.5 0 1 --wo -0.2 0.1 1"},
      argc, argv);
}

int askPlane(int argc, char** argv) {
  return ask<apps::PlaneCommand>({"glint-query plane", "Asks an endless plane of Wang tiles how normals are distributed.",
                                  "glint-query plane flakes.wang.glint --texel 1e12 0.5 --sigma 8 --half 0.1 -0.05"},
                                 argc, argv);
}
}  // namespace

int main(int argc, char** argv) {
  return apps::runCommand(argc, argv, {{"light", askLight}, {"reflectance", askReflectance}, {"plane", askPlane}},
                          askDistribution);
}
