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
  if (options.check_values && !findings.failed()) state->loaded.codec->check_data(state->loaded.model, findings);
  if (options.verify_hashes && !findings.failed()) checkHashes(state->loaded, findings);
  findings.throwFirstError();
  for (const Finding& finding : findings.report().findings) {
    state->loaded.info.warnings.push_back(finding.object + ": " + finding.message);
  }
  return Asset(std::move(state));
}

std::string_view Asset::kind() const { return state_->loaded.info.kind; }

const AssetInfo& Asset::info() const { return state_->loaded.info; }

template <class Model>
const Model& Asset::get() const {
  if (const Model* model = std::get_if<Model>(&state_->loaded.model)) return *model;
  const std::string wanted(kindName<Model>());
  throw Error(ErrorCode::unsupported, "format.kind", state_->path, {},
              "is of kind " + state_->loaded.info.kind + ", not " + wanted, "pass an asset of kind " + wanted);
}

template const NormalMap& Asset::get() const;
template const HeightMap& Asset::get() const;
template const NdfPyramid& Asset::get() const;
template const NdfCp& Asset::get() const;
template const BinMap& Asset::get() const;
template const HistogramSat& Asset::get() const;
template const ShLight& Asset::get() const;
template const ShLobes& Asset::get() const;
template const Displacement& Asset::get() const;

}  // namespace glint::formats
