#include "glint/formats/validate.h"

#include "glint/formats/load.h"

namespace glint::formats {

ValidationReport validateAsset(const std::filesystem::path& path, const ValidateOptions& options) {
  Findings findings(path);
  const LoadedAsset asset = loadAsset(path, findings);
  if (options.hashes) checkHashes(asset, findings);
  // Values are only looked at through indices that hold.
  if (options.data && asset.codec != nullptr) asset.codec->check_data(asset.model, findings);
  return std::move(findings.report());
}

}  // namespace glint::formats
