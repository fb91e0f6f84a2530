#include "common/input_asset.h"

#include "common/texel_checks.h"

namespace glint::apps {

formats::OpenOptions inputChecks(const Tool& tool) { return {.verify_hashes = !tool.trust(), .check_values = !tool.trust()}; }

formats::Asset openInput(const Tool& tool, const std::string& path, UdimSets tiles) {
  formats::Asset asset = formats::Asset::open(path, inputChecks(tool));
  if (tiles == UdimSets::refused && asset.info().udim) refuseTile(tool, path);
  if (tool.trust()) requireTexels(asset, path);
  return asset;
}

}  // namespace glint::apps
