#include "common/ndf_models.h"

#include <fmt/format.h>

#include "common/files.h"
#include "glint/bake/reference_image.h"

namespace glint::apps {

NdfAsset::NdfAsset(Tool& tool) {
  tool.option("ASSET", path_, "asset of kind normals, ndf-pyramid, ndf-cp, bin-map, histogram-sat or displacement").required();
  tool.option("--normals", normals_path_,
              "asset of kind normals that the pyramid was made from, for footprints below its finest level");
  tool.choice("--surface", options_.surface, {{"flat", Surface::flat}, {"smooth", Surface::smooth}},
              "how normals behave between texels (kind normals)");
  tool.choice("--boundary", options_.boundary, {{"wrap", Boundary::wrap}, {"clamp", Boundary::clamp}},
              "beyond the border of the map (kind normals)");
  tool.option("--sigma-r", options_.sigma_r, "intrinsic roughness, disk units (kind normals; histogram-sat with --light)")
      .range(1e-4, 0.25);
  tool.option("--alpha", options_.alpha, "Beckmann roughness, in the range of the asset (kind bin-map)")
      .range(1e-4, 1)
      .defaultText("the smallest of the asset");
  tool.choice("--gaussian-boxes", options_.gaussian_boxes, {{"1", GaussianBoxes::one}, {"3", GaussianBoxes::three}},
              "boxes that stand for a Gaussian footprint (kind histogram-sat)");
  tool.option("--slant-tolerance", options_.slant_tolerance,
              "share of a footprint with slanted sides that may be misplaced; 0: exact, and slower (kind histogram-sat)")
      .range(0, 1);
  tool.addCheck([this] {
    checkReadable(path_);
    if (!normals_path_.empty()) checkReadable(normals_path_);
  });
}

void NdfAsset::open() {
  options_.normals = normals_path_;
  opened_ = api::OpenedNdf::open(path_, options_);
}

std::optional<std::vector<float>> NdfAsset::scatteredImage(const Footprint& footprint, int size) const {
  if (!std::holds_alternative<Reference>(model()) || options_.surface != Surface::flat) return std::nullopt;
  return bake::referenceImage(opened_->asset().normals(), options_.sigma_r, options_.surface, options_.boundary, footprint,
                              size);
}

void NdfAsset::requireAnswerable(const Footprint& footprint) const {
  if (opened_->hasNormals()) return;
  const auto check = [&](const PyramidShape& shape) {
    const float sigma = isotropicSigma(shape, footprint), finest = finestSigma(shape);
    if (sigma >= finest * 0.999f) return;
    throw Error(ErrorCode::usage, "query.footprint", path_, "",
                fmt::format("a footprint of {:.3g} texels is below the finest level, {:.3g} texels", sigma, finest),
                "add --normals with the asset that the pyramid was made from");
  };
  if (const auto* pyramid = std::get_if<PyramidNdf>(&model())) check(pyramid->shape());
  if (const auto* compressed = std::get_if<CpNdf>(&model())) check(compressed->shape());
}

}  // namespace glint::apps
