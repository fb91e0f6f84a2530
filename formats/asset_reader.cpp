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
const Model& Asset::get(std::string_view wanted) const {
  if (const Model* model = std::get_if<Model>(&state_->loaded.model)) return *model;
  throw Error(ErrorCode::unsupported, "format.kind", state_->path, {},
              "is of kind " + state_->loaded.info.kind + ", not " + std::string(wanted),
              "pass an asset of kind " + std::string(wanted));
}

const NormalMap& Asset::normals() const { return get<NormalMap>("normals"); }
const HeightMap& Asset::heights() const { return get<HeightMap>("heights"); }
const NdfPyramid& Asset::pyramid() const { return get<NdfPyramid>("ndf-pyramid"); }
const CompressedNdf& Asset::compressed() const { return get<CompressedNdf>("ndf-cp"); }
const BinMap& Asset::binMap() const { return get<BinMap>("bin-map"); }
const HistogramSat& Asset::histograms() const { return get<HistogramSat>("histogram-sat"); }
const ShLight& Asset::shLight() const { return get<ShLight>("sh-light"); }
const ShLobes& Asset::shLobes() const { return get<ShLobes>("sh-lobes"); }
const Displacement& Asset::displacement() const { return get<Displacement>("displacement"); }

}  // namespace glint::formats
