#include <algorithm>
#include <filesystem>
#include <nlohmann/json.hpp>

#include "common/files.h"
#include "common/image_io.h"
#include "common/memory_needs.h"
#include "common/normal_image.h"
#include "glint-synth/synth_options.h"

using namespace glint;

int main(int argc, char** argv) {
  apps::Tool tool(
      {"glint-synth",
       "Makes a tileable procedural normal map or height field, as an image (.exr, .png, ...). Normals are encoded 0..1 "
       "with green up (OpenGL); heights are in texels or micrometres.",
       "glint-synth flakes -o flakes.exr --size 1024 --alpha 0.2 --flake-size 6 --seed 7"});
  apps::SynthOptions options(tool);
  const apps::OutputFile output(tool, apps::OutputFormat::image, "image; the extension gives the format");
  bool heights = false, presence = false;
  int bits = 0;
  const apps::Option& height_option =
      tool.flag("--height", heights, "write heights, in texels or (--texel-size-um) micrometres, instead of normals");
  tool.flag("--presence", presence,
            "write the output `presence` of flake2d instead of normals: one channel, 0 where there is no flake")
      .excludes(height_option);
  const apps::Option& bits_option = tool.option("--bits", bits, "of a channel: 8 or 16 (png), 16 or 32 (exr)")
                                        .range(8, 32)
                                        .defaultText("8 for png, 32 for exr");
  tool.addCheck([&] {
    bits = apps::pixelBits(output.path(), bits_option.given() ? bits : 0);
    apps::requireFloatImage(output.path(), heights, "heights");
  });

  return tool.run(argc, argv, [&] {
    const bake::SynthOptions& p = options.values(tool);
    apps::requireMemoryFor(tool, "a map of", p.width, p.height, apps::BytesPerTexel::kSynth, "give a smaller --size");
    const apps::PixelFormat format = apps::pixelFormat(output.path(), bits);
    if (heights) {
      std::vector<float> values = bake::synthHeights(p);
      if (options.texelSize() > 0)
        for (float& value : values) value *= options.texelSize();
      apps::writeImage(output.path(), p.width, p.height, 1, values, format);
    } else if (presence) {
      apps::writeImage(output.path(), p.width, p.height, 1, bake::synthPresence(p), format);
    } else {
      apps::writeImage(output.path(), p.width, p.height, 3, apps::encodeNormals(bake::synthNormals(p)), format);
    }
    if (p.kind == bake::SynthKind::flake2d && !bake::flake2dTiles(p))
      tool.warn("the map does not tile: its sides hold no whole numbers of flakes, so flakes are cut at the border");
    tool.setResult({{"width", p.width}, {"height", p.height}, {"command", nlohmann::json::parse(tool.commandJson())}});
    tool.summary(tool.name() + ": " + std::to_string(p.width) + " x " + std::to_string(p.height) + " texels\n");
  });
}
