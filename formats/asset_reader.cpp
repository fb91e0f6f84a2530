#include "glint/formats/asset_reader.h"

#include "glint/formats/load.h"

namespace glint::formats {

struct Asset::State {
  std::string path;
  LoadedAsset loaded;
};

Asset::Asset(std::unique_ptr<State> state) : state_(std::move(state)) {}
Asset::Asset(Asset&&) noexcept = default;
Asset& Asset::operator=(Asset&&) noexcept = default;
Asset::~Asset() = default;

Asset Asset::open(const std::filesystem::path& path, const OpenOptions& options) {
  Findings findings(path);
  auto state = std::make_unique<State>(State{path.string(), loadAsset(path, findings)});
  // Values first: they say which texel is wrong where a hash can only say which dataset.
  if (options.check_values && !findings.failed()) state->loaded.kind->check_values(*state->loaded.asset, findings);
  if (options.verify_hashes && !findings.failed()) checkHashes(state->loaded, findings);
  findings.throwFirstError();
  for (const Finding& finding : findings.report().findings) {
    state->loaded.info.warnings.push_back(finding.object + ": " + finding.message);
  }
  return Asset(std::move(state));
}

std::string_view Asset::kind() const { return state_->loaded.info.kind; }

const AssetInfo& Asset::info() const { return state_->loaded.info; }

const AnyAsset& Asset::any() const { return *state_->loaded.asset; }

void Asset::refuse(const AnyAsset& wanted) const {
  const std::string kind(kinds()[wanted.index()]->schema.name);
  throw Error(ErrorCode::unsupported, "format.kind", state_->path, {},
              "is of kind " + state_->loaded.info.kind + ", not " + kind, "pass an asset of kind " + kind);
}

}  // namespace glint::formats
