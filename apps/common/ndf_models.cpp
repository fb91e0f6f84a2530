#include "common/ndf_models.h"

#include <fmt/format.h>

#include <algorithm>
#include <filesystem>

#include "common/files.h"
#include "glint/bake/reference_image.h"
#include "glint/formats/hash.h"

namespace glint::apps {
namespace {

constexpr int kReferenceResolution = 256;

}  // namespace

NdfAsset::NdfAsset(Tool& tool) : tool_(tool) {
  tool.option("ASSET", path_, "asset of kind normals, ndf-pyramid or ndf-cp").required();
  tool.option("--normals", normals_path_,
              "asset of kind normals that the pyramid was made from, for footprints below its finest level");
  tool.choice("--surface", surface_, {{"flat", Surface::flat}, {"smooth", Surface::smooth}},
              "how normals behave between texels (kind normals)");
  tool.choice("--boundary", boundary_, {{"wrap", Boundary::wrap}, {"clamp", Boundary::clamp}},
              "beyond the border of the map (kind normals)");
  tool.option("--sigma-r", sigma_r_, "intrinsic roughness, disk units (kind normals)").range(1e-4, 0.25);
  tool.addCheck([this] {
    checkReadable(path_);
    if (!normals_path_.empty()) checkReadable(normals_path_);
  });
}

void NdfAsset::open() {
  asset_ = formats::Asset::open(path_);
  if (!normals_path_.empty()) normals_ = formats::Asset::open(normals_path_);
  const auto make = [&](const auto& view, auto tag) -> AnyNdf {
    using Model = typename decltype(tag)::type;
    if (!normals_) return Model(view);
    requireSameMap(view.shape, asset_->info());
    return Model(view, normals_->normals());
  };
  if (asset_->kind() == "ndf-pyramid")
    model_ = make(asset_->pyramid(), std::type_identity<PyramidNdf>());
  else if (asset_->kind() == "ndf-cp")
    model_ = make(asset_->compressed(), std::type_identity<CpNdf>());
  else
    model_ = Reference(asset_->normals(), sigma_r_, surface_, boundary_, Reference::Search::pruned);
}

int NdfAsset::resolution() const {
  if (const auto* pyramid = std::get_if<PyramidNdf>(&*model_)) return pyramid->shape().resolution;
  if (const auto* compressed = std::get_if<CpNdf>(&*model_)) return compressed->shape().resolution;
  return kReferenceResolution;
}

std::optional<std::vector<float>> NdfAsset::scatteredImage(const Footprint& footprint, int size) const {
  if (!std::holds_alternative<Reference>(*model_) || surface_ != Surface::flat) return std::nullopt;
  return bake::referenceImage(asset_->normals(), sigma_r_, surface_, boundary_, footprint, size);
}

void NdfAsset::requireAnswerable(const Footprint& footprint) const {
  if (normals_) return;
  const auto check = [&](const PyramidShape& shape) {
    const float sigma = isotropicSigma(shape, footprint), finest = finestSigma(shape);
    if (sigma >= finest * 0.999f) return;
    throw Error(ErrorCode::usage, "query.footprint", path_, "",
                fmt::format("a footprint of {:.3g} texels is below the finest level, {:.3g} texels", sigma, finest),
                "add --normals with the asset that the pyramid was made from");
  };
  if (const auto* pyramid = std::get_if<PyramidNdf>(&*model_)) check(pyramid->shape());
  if (const auto* compressed = std::get_if<CpNdf>(&*model_)) check(compressed->shape());
}

void NdfAsset::requireSameMap(const PyramidShape& shape, const formats::AssetInfo& info) const {
  const NormalMap& map = normals_->normals();
  // A pyramid names its map as an input; what was compressed from a pyramid names that, so only the size can be compared.
  const auto& inputs = info.provenance.inputs;
  const std::string hash = info.kind == "ndf-pyramid" ? formats::hashFile(normals_path_) : std::string();
  const bool named = hash.empty() || inputs.empty() ||
                     std::any_of(inputs.begin(), inputs.end(), [&](const auto& input) { return input.hash_hex == hash; });
  if (named && map.width == shape.width && map.height == shape.height) return;
  throw Error(ErrorCode::invalid_input, "query.normals", normals_path_, "",
              "this is not the map that " + path_ + " was made from", "give the asset that glint-pyramid read");
}

}  // namespace glint::apps
