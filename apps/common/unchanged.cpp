#include "common/unchanged.h"

#include <sys/stat.h>

#include <algorithm>
#include <optional>

#include "glint/formats/asset_reader.h"

namespace glint::apps {
namespace {

/// How a whole asset was made; nothing of other files.
std::optional<formats::Provenance> provenanceOf(const std::string& path, bool trust) {
  struct stat info {};
  if (::stat(path.c_str(), &info) != 0 || !S_ISREG(info.st_mode)) return {};  // a pipe would wait for who writes to it
  try {
    return formats::Asset::open(path, {.verify_hashes = !trust}).info().provenance;
  } catch (const Error&) {
    return {};
  }
}

}  // namespace

bool isMadeBy(const std::string& path, const formats::Provenance& run, const std::function<formats::Provenance()>& inputs,
              bool trust) {
  std::optional<formats::Provenance> made = provenanceOf(path, trust);
  if (!made || made->generator != run.generator || made->command_json != run.command_json) return false;
  std::erase_if(made->inputs, formats::isChained);
  return made->inputs == inputs().inputs;
}

}  // namespace glint::apps
