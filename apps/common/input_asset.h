#pragma once

#include <string>

#include "common/files.h"
#include "common/tool.h"
#include "glint/formats/asset_reader.h"

namespace glint::apps {

/// The checks of assets that a tool uses: hashes and values, or with --trust neither.
formats::OpenOptions inputChecks(const Tool& tool);

/// Opens an asset that a tool makes something of, with inputChecks(). Flipped bits never reach a result: hashes are compared, and
/// an error names the first texel that is wrong. With --trust only texels are looked at that would crash a builder.
/// @param tiles  whether the tool knows assets of UDIM tiles, which have margins
/// @throws Error  as formats::Asset::open
formats::Asset openInput(const Tool& tool, const std::string& path, UdimSets tiles = UdimSets::refused);

}  // namespace glint::apps
