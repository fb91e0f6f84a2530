#include "glint/formats/asset_reader.h"

#include <utility>

#include "glint/formats/load.h"
#include "glint/formats/rules.h"

namespace glint::formats {

struct Asset::State {
  Findings findings;
  LoadedAsset loaded;
};

Asset::Asset(std::unique_ptr<State> state) : state_(std::move(state)) {}
Asset::Asset(Asset&&) noexcept = default;
Asset& Asset::operator=(Asset&&) noexcept = default;
Asset::~Asset() = default;

Asset Asset::open(const std::filesystem::path& path, const OpenOptions& options) {
  auto state = std::make_unique<State>(State{Findings(path), {}});
  state->loaded = loadFile(state->findings, options.copy);
  return checked(std::move(state), options);
}

Asset Asset::openMemory(std::span<const std::byte> bytes, const std::string& name, const OpenOptions& options) {
  auto state = std::make_unique<State>(State{Findings(name), {}});
  state->loaded = loadAsset(FileBytes::ofMemory(bytes, options.copy), state->findings);
  return checked(std::move(state), options);
}

Asset Asset::openSource(const AssetSource& source, const OpenOptions& options) {
  auto state = std::make_unique<State>(State{Findings(source.name), {}});
  try {
    state->loaded = loadAsset(FileBytes::ofSource(source.size, source.read), state->findings);
  } catch (const Error& error) {
    state->findings.add(error);
  }
  return checked(std::move(state), options);
}

Asset Asset::checked(std::unique_ptr<State> state, const OpenOptions& options) {
  Findings& findings = state->findings;
  LoadedAsset& loaded = state->loaded;
  // Values first: they say which texel is wrong where a hash can only say which dataset.
  if (options.check_values && !findings.failed()) checkValues(loaded, findings);
  if (options.verify_hashes && !findings.failed()) {
    const bool in_pieces = options.hash_in_pieces && !options.copy && loaded.structure.bytes.isMapped();
    checkHashes(loaded, findings, in_pieces ? HashFrom::file : HashFrom::memory);
  }
  findings.throwFirstError();
  for (const Finding& finding : findings.report().findings)
    loaded.info.warnings.push_back(finding.object + ": " + finding.message);
  return Asset(std::move(state));
}

std::string_view Asset::kind() const { return state_->loaded.info.kind; }

const AssetInfo& Asset::info() const { return state_->loaded.info; }

const AnyAsset& Asset::any() const { return *state_->loaded.asset; }

void Asset::leaveOutNearNormals() {
  std::visit(
      [](auto& asset) {
        if constexpr (requires { asset.near_normals.reset(); }) asset.near_normals.reset();
      },
      *state_->loaded.asset);
}

void Asset::refuse(const AnyAsset& wanted) const {
  const std::string kind(kinds()[wanted.index()]->schema.name);
  const bool shard = std::holds_alternative<NdfPyramidShard>(any());
  throw Error(ErrorCode::unsupported, "format.kind", state_->findings.path(), {},
              "is of kind " + state_->loaded.info.kind + ", not " + kind,
              shard ? std::string(kJoinShards) : "pass an asset of kind " + kind);
}

}  // namespace glint::formats
