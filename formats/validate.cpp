#include "glint/formats/validate.h"

#include <utility>

#include "glint/formats/load.h"

namespace glint::formats {

namespace {

ValidationReport validated(const LoadedAsset& loaded, Findings findings, const ValidateOptions& options) {
  if (options.hashes) checkHashes(loaded, findings);
  // Values are only looked at through indices that hold.
  if (options.data && loaded.asset) checkValues(loaded, findings);
  return std::move(findings.report());
}

}  // namespace

ValidationReport validateAsset(const std::filesystem::path& path, const ValidateOptions& options) {
  Findings findings(path);
  const LoadedAsset loaded = loadFile(findings);
  return validated(loaded, std::move(findings), options);
}

ValidationReport validateMemory(std::span<const std::byte> bytes, const std::string& name, const ValidateOptions& options) {
  Findings findings(name);
  const LoadedAsset loaded = loadAsset(FileBytes::ofMemory(bytes, false), findings);
  return validated(loaded, std::move(findings), options);
}

}  // namespace glint::formats
