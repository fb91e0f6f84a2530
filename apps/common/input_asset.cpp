#include "common/input_asset.h"

namespace glint::apps {

formats::OpenOptions inputChecks(const Tool& tool) { return {.verify_hashes = !tool.trust(), .check_values = !tool.trust()}; }

formats::Asset openInput(const Tool& tool, const std::string& path) { return formats::Asset::open(path, inputChecks(tool)); }

}  // namespace glint::apps
