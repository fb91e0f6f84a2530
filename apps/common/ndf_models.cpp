#include "common/ndf_models.h"

#include <fmt/format.h>
#include <tbb/parallel_for.h>

#include <algorithm>
#include <cmath>

#include "common/files.h"
#include "common/texel_checks.h"
#include "glint/api/alternatives.h"
#include "glint/api/plane_position.h"
#include "glint/api/wave_colours.h"
#include "glint/bake/common/reference_image.h"

namespace glint::apps {
namespace {
/// Deviation of the round footprint of the same mean square size, texels.
float meanSigma(const Footprint& p) { return std::sqrt(0.5f * (p.covariance.xx + p.covariance.yy)); }
}  // namespace

NdfAsset::NdfAsset(Tool& tool, const AskedAssets& asked) : tool_(tool), asked_(asked) {
  tool.option("ASSET", path_,
              "asset of kind " + api::alternatives(asked.kinds) +
                  (asked.udim_sets ? "; 'name.<UDIM>.glint': a UDIM set, --uv counts tiles" : ""))
      .required();
  if (asks({"ndf-pyramid", "ndf-cp", "wave-cp", "wave-pyramid"})) addPyramidOptions();
  addNormalsOptions();
  addBinOptions();
  tool.addCheck([this] { check(); });
}

void NdfAsset::check() {
  const UdimSets sets = asked_.udim_sets ? UdimSets::taken : UdimSets::refused;
  for (const std::string& path : {path_, normals_path_})
    if (!path.empty()) addInputs(tool_, path, sets);
}

void NdfAsset::addPyramidOptions() {
  useOnly({"ndf-pyramid", "ndf-cp"}, "--normals",
          tool_.option(
              "--normals", normals_path_,
              "asset of kind normals that the pyramid was made from, for footprints below its finest level; instead of the "
              "normals that the pyramid keeps, if it does"));
  useOnly(
      {"ndf-pyramid", "ndf-cp"}, "--kept-normals",
      tool_.choice("--kept-normals", options_.use_kept_normals, {{"used", true}, {"ignored", false}},
                   "whether the normals that the pyramid keeps answer small footprints: without them it answers as one that "
                   "keeps none, to compare, or for speed (kinds ndf-pyramid and ndf-cp)"));
  useOnly({"ndf-pyramid", "ndf-cp", "slope-moments", "wang-cp", "wang-pyramid", "wave-cp", "wave-pyramid"}, "--parts",
          tool_
              .option("--parts", options_.footprint_parts,
                      "most round footprints that stand for a stretched one; 1: one of the same mean square size (kinds "
                      "ndf-pyramid, ndf-cp, slope-moments, wang-cp, wang-pyramid, wave-cp and wave-pyramid)")
              .range(1, IsotropicParts::kMost));
  addImageOptions();
}

void NdfAsset::addImageOptions() {
  useOnly(
      {"ndf-pyramid", "ndf-cp", "wave-cp", "wave-pyramid"}, "--interpolation",
      tool_.choice("--interpolation", options_.interpolation,
                   {{"footprint", Interpolation::footprint}, {"trilinear", Interpolation::trilinear}},
                   "how footprints between the stored ones are answered: by images that together see the footprint, or "
                   "trilinearly, which is quicker and sees a wider one (kinds ndf-pyramid, ndf-cp, wave-cp and wave-pyramid)"));
  useOnly(
      {"ndf-pyramid", "ndf-cp", "wang-cp", "wang-pyramid", "wave-cp", "wave-pyramid"}, "--pixels",
      tool_.choice("--pixels", options_.pixels, {{"smooth", Pixels::smooth}, {"constant", Pixels::constant}},
                   "how densities run between half vectors of one pixel of an image: continuously, or constant, which is "
                   "quicker and shows borders of pixels under small lights (kinds ndf-pyramid, ndf-cp, wang-cp, wang-pyramid "
                   "wave-cp and wave-pyramid)"));
}

void NdfAsset::addNormalsOptions() {
  if (asked_.smooth_surfaces)
    useOnly({"normals", "wang-tiles"}, "--surface",
            tool_.choice("--surface", options_.surface, {{"flat", Surface::flat}, {"smooth", Surface::smooth}},
                         "how normals behave between texels (kinds normals and wang-tiles)"));
  useOnly({"normals"}, "--boundary",
          tool_.choice("--boundary", options_.boundary, {{"wrap", Boundary::wrap}, {"clamp", Boundary::clamp}},
                       "beyond the border of the map (kind normals)"));
  useOnly({"normals", "histogram-sat", "slope-moments", "wang-tiles"}, "--sigma-r",
          tool_
              .option("--sigma-r", options_.sigma_r,
                      "intrinsic roughness, disk units (kinds normals, slope-moments, wang-tiles and histogram-sat)")
              .range(1e-4, 0.25));
}

void NdfAsset::addBinOptions() {
  if (asks({"bin-map"})) {
    useOnly({"bin-map"}, "--alpha",
            tool_.option("--alpha", options_.alpha, "Beckmann roughness, in the range of the asset (kind bin-map)")
                .range(1e-4, 1)
                .defaultText("the smallest of the asset"));
    useOnly({"bin-map"}, "--estimator",
            tool_.choice(
                "--estimator", options_.estimator, {{"exact", BinEstimator::exact}, {"published", BinEstimator::published}},
                "how densities are made of the texels: by their normals, or by the centres of 21 bins, which is quicker "
                "and less exact (kind bin-map)"));
  }
  if (!asks({"histogram-sat"})) return;
  useOnly(
      {"histogram-sat"}, "--bins",
      tool_.choice("--bins", options_.histogram_bins, {{"even", HistogramBins::even}, {"lobes", HistogramBins::lobes}},
                   "where the normals of a bin are: even over the bin, which shows borders of bins under small lights, or in "
                   "a lobe with their mean and spread over the map, which is slower (kind histogram-sat)"));
  useOnly({"histogram-sat"}, "--gaussian-boxes",
          tool_.choice("--gaussian-boxes", options_.gaussian_boxes, {{"1", GaussianBoxes::one}, {"3", GaussianBoxes::three}},
                       "boxes that stand for a Gaussian footprint (kind histogram-sat)"));
  useOnly(
      {"histogram-sat"}, "--slant-tolerance",
      tool_
          .option("--slant-tolerance", options_.slant_tolerance,
                  "share of a footprint with slanted sides that may be misplaced; 0: exact, and slower (kind histogram-sat)")
          .range(0, 1));
}

bool NdfAsset::asks(std::initializer_list<std::string_view> kinds) const {
  return std::find_first_of(asked_.kinds.begin(), asked_.kinds.end(), kinds.begin(), kinds.end()) != asked_.kinds.end();
}

void NdfAsset::useOnly(std::initializer_list<std::string_view> kinds, const std::string& name, const Option& option) {
  kind_options_.push_back({kinds, name, &option});
}

void NdfAsset::refuseOtherKinds() const {
  const bool pattern = formats::isUdimPattern(path_);
  const formats::Asset asset = formats::Asset::open(pattern ? formats::udimFile(path_, formats::udimTiles(path_).front())
                                                            : std::filesystem::path(path_));
  if (asset.info().udim && !asked_.udim_sets) refuseTile(tool_, path_);
  const std::string kind(asset.kind());
  if (kind == "displacement")
    throw Error(
        ErrorCode::unsupported, "format.kind", path_, "", "is of kind displacement, which holds no distribution of normals",
        "ask for the light that it reflects: glint-query reflectance " + path_ + " --uv U V --sigma S --wi X Y Z --wo X Y Z");
  if (api::answersNdf(kind) && !asks({kind}))
    throw Error(ErrorCode::unsupported, "format.kind", path_, "", "is of kind " + kind + ", which is not asked this",
                "pass an asset of kind " + api::alternatives(asked_.kinds));
}

void NdfAsset::open(const formats::OpenOptions& checks) {
  refuseOtherKinds();
  options_.normals = normals_path_;
  options_.checks = checks;
  opened_ = api::OpenedNdf::open(path_, options_);
  const auto kind = opened_->asset().kind();
  for (const KindOption& o : kind_options_)
    if (o.option->given() && std::find(o.kinds.begin(), o.kinds.end(), kind) == o.kinds.end())
      tool_.warn(fmt::format("{} has no effect: {} is of kind {}", o.name, path_, kind));
}

std::optional<std::vector<float>> NdfAsset::scatteredImage(const Footprint& footprint, int size) const {
  if (!std::holds_alternative<Reference>(model()) || options_.surface != Surface::flat) return std::nullopt;
  if (tool_.trust()) requireNormals(opened_->asset().get<NormalMap>(), path_);
  return bake::referenceImage(opened_->asset().get<NormalMap>(), options_.sigma_r, options_.surface, options_.boundary,
                              footprint, size);
}

namespace {

const WavePyramid& assetOf(const WaveNdf& model) { return model.wavePyramid(); }
const WaveCp& assetOf(const WaveCpNdf& model) { return model.waveCp(); }

/// Linear sRGB of the pixels of an image, [size][size][3].
/// @param constant  a model whose pixels are constant
template <class Model>
std::vector<float> colourPixels(const Model& constant, const Footprint& footprint, int size, int resolution) {
  // Points of a pixel along each axis: one where the pixels are those of the images.
  const int points = size == resolution ? 1 : 4;
  const float step = 2 / static_cast<float>(size * points);
  std::vector<float> image(static_cast<std::size_t>(size) * static_cast<std::size_t>(size) * 3);
  tbb::parallel_for(0, size, [&](int y) {
    for (int x = 0; x < size; ++x) {
      Rgb sum;
      for (int k = 0; k < points * points; ++k) {
        const float column = static_cast<float>(x * points + k % points), row = static_cast<float>(y * points + k / points);
        sum = sum + constant.densityRgb(footprint, {(column + 0.5f) * step - 1, (row + 0.5f) * step - 1});
      }
      const Rgb mean = 1 / static_cast<float>(points * points) * sum;
      float* pixel = &image[3 * rowMajorIndex(x, y, size)];
      pixel[0] = mean.r, pixel[1] = mean.g, pixel[2] = mean.b;
    }
  });
  return image;
}

}  // namespace

std::optional<std::vector<float>> NdfAsset::colourImage(const Footprint& footprint, int size) const {
  using Image = std::optional<std::vector<float>>;
  return api::askWave(
      model(),
      [&](const auto& asked) -> Image {
        using Round = std::remove_cvref_t<decltype(asked.round())>;
        const Round constant(assetOf(asked.round()), options_.interpolation, Pixels::constant);
        return colourPixels(AnisotropicNdf<Round>(constant, options_.footprint_parts), footprint, size, info().resolution);
      },
      []() -> Image { return std::nullopt; });
}

bool NdfAsset::lacksTileAt(double u, double v) const {
  const auto* set = std::get_if<api::UdimNdf>(&model());
  return set != nullptr && set->tiles().at(api::planeCell(u), api::planeCell(v)) == nullptr;
}

bool NdfAsset::widens(const Footprint& footprint) const {
  if (std::holds_alternative<api::UdimNdf>(model())) return meanSigma(footprint) < info().smallest_sigma_texels;
  return std::visit(
      [&](const auto& m) {
        if constexpr (requires { m.round().smallestSigma(); })
          return isotropicSigma(m.round().shape(), footprint) < m.round().smallestSigma();
        else
          return false;
      },
      model());
}

std::string NdfAsset::normalsRemedy() const {
  if (!options_.use_kept_normals) return "leave --kept-normals ignored out, of a pyramid that was made with --keep-normals";
  if (std::holds_alternative<api::UdimNdf>(model()))
    return "add --normals with the pattern of the assets that the pyramids were made from, or make every pyramid with "
           "--keep-normals";
  return "add --normals with the asset that the pyramid was made from, or make the pyramid with --keep-normals";
}

std::optional<FootprintFault> NdfAsset::unanswerable(const Footprint& footprint) const {
  if (opened_->hasNormals()) return {};
  if (std::holds_alternative<api::UdimNdf>(model())) {
    const float sigma = meanSigma(footprint), finest = info().finest_sigma_texels;
    if (sigma >= finest * 0.999f || opened_->asset().kind() == "slope-moments") return {};
    return FootprintFault{fmt::format("a footprint of {:.3g} texels is below the finest level, {:.3g} texels", sigma, finest),
                          normalsRemedy()};
  }
  return std::visit(
      [&](const auto& m) -> std::optional<FootprintFault> {
        if constexpr (requires { m.round().shape(); }) {
          const float sigma = isotropicSigma(m.round().shape(), footprint), finest = info().finest_sigma_texels;
          if (sigma >= finest * 0.999f) return {};
          return FootprintFault{
              fmt::format("a footprint of {:.3g} texels is below the finest level, {:.3g} texels", sigma, finest),
              api::isWave(model())
                  ? "make the pyramid again with a smaller --stride: without their neighbours texels do not diffract"
                  : normalsRemedy()};
        } else {
          return {};
        }
      },
      model());
}

}  // namespace glint::apps
