#include "glint/formats/validate.h"

#include "glint/formats/load.h"

namespace glint::formats {

ValidationReport validateAsset(const std::filesystem::path& path, const ValidateOptions& options) {
  Findings findings(path);
  const LoadedAsset loaded = loadFile(findings);
  if (options.hashes) checkHashes(loaded, findings);
  // Values are only looked at through indices that hold.
  if (options.data && loaded.asset) checkValues(loaded, findings);
  return std::move(findings.report());
}

}  // namespace glint::formats
