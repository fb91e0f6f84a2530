#include "glint/api/any_ndf.h"

#include <algorithm>
#include <string>
#include <vector>

#include "glint/formats/hash.h"
#include "glint/formats/number_text.h"
#include "glint/query/brdf/slope_sums.h"

namespace glint::api {
namespace {

/// Pixels of a picture of a model that has no images of its own.
constexpr int kReferenceResolution = 256;

void requireSameMap(const formats::Asset& asset, const std::filesystem::path& path, const NdfInfo& info, const NormalMap& map,
                    const std::filesystem::path& normals_path) {
  // A pyramid names its map as an input; what was compressed from a pyramid names it as an input of that. Files that name no
  // such input can be compared by size only.
  const bool pyramid = asset.kind() == "ndf-pyramid";
  std::vector<formats::InputRecord> maps;
  for (const formats::InputRecord& input : asset.info().provenance.inputs)
    if (pyramid || formats::isChained(input)) maps.push_back(input);
  const std::string hash = maps.empty() ? std::string() : formats::hashFile(normals_path);
  const bool named =
      maps.empty() || std::any_of(maps.begin(), maps.end(), [&](const auto& input) { return input.hash_hex == hash; });
  if (named && map.width == info.width && map.height == info.height) return;
  throw Error(ErrorCode::invalid_input, "query.normals", normals_path.string(), "",
              "this is not the map that " + path.string() + " was made from", "give the asset that glint-pyramid read");
}

NdfInfo infoOf(const PyramidShape& shape) {
  return {shape.width,
          shape.height,
          shape.resolution,
          shape.sigma_r,
          shape.surface,
          shape.boundary,
          shape.footprintLevels(),
          finestSigma(shape),
          kFootprintPerStride * shape.levels[shape.footprintLevels() - 1].stride};
}

NdfInfo infoOf(const NormalMap& map, const NdfOptions& options) {
  return {map.width, map.height, kReferenceResolution, options.sigma_r, options.surface, options.boundary, 0, 0, 0};
}

NdfInfo infoOf(const HistogramSat& sat) {
  return {sat.width, sat.height, kReferenceResolution, 0, Surface::flat, Boundary::wrap, 0, 0, 0};
}

MapSlopes slopesOf(const NormalMap& map) {
  const auto width = static_cast<std::size_t>(map.width);
  SlopeSums sums;
  for (std::size_t j = 0; j < static_cast<std::size_t>(map.height); ++j)
    sums.add(slopeSums(map.normals.data() + j * width, width));
  return sums.moments(static_cast<double>(map.width) * map.height);
}

float askedAlpha(const BinMap& map, float alpha, const std::filesystem::path& path) {
  if (alpha == 0) return map.alpha_min;
  if (alpha >= map.alpha_min && alpha <= map.alpha_max) return alpha;
  throw Error(ErrorCode::usage, "query.alpha", path.string(), "",
              "was made for roughnesses of " + formats::numberText(map.alpha_min) + " to " +
                  formats::numberText(map.alpha_max) + ", not " + formats::numberText(alpha),
              "ask within the range, or make it with glint-binmap --alpha A:B");
}

}  // namespace

template <class Model, class View>
void OpenedNdf::setPyramid(const View& view, int footprint_parts) {
  model_ = AnisotropicNdf<Model>(normals_ ? Model(view, normals_->get<NormalMap>()) : Model(view), footprint_parts);
  info_ = infoOf(view.shape);
}

OpenedNdf OpenedNdf::open(const std::filesystem::path& path, const NdfOptions& options) {
  const formats::OpenOptions open_options = {options.verify_hashes, options.check_values};
  OpenedNdf opened(path, formats::Asset::open(path, open_options));
  if (!options.normals.empty()) opened.normals_ = formats::Asset::open(options.normals, open_options);
  const formats::Asset& asset = opened.asset_;

  // A new kind is a line here, and its model in AnyNdf.
  if (asset.kind() == "normals") {
    opened.model_ =
        Reference(asset.get<NormalMap>(), options.sigma_r, options.surface, options.boundary, Reference::Search::pruned);
    opened.info_ = infoOf(asset.get<NormalMap>(), options);
  } else if (asset.kind() == "ndf-pyramid") {
    opened.setPyramid<PyramidNdf>(asset.get<NdfPyramid>(), options.footprint_parts);
  } else if (asset.kind() == "ndf-cp") {
    opened.setPyramid<CpNdf>(asset.get<NdfCp>(), options.footprint_parts);
  } else if (asset.kind() == "bin-map") {
    const BinMap& map = asset.get<BinMap>();
    const BinMapNdf ndf(map, askedAlpha(map, options.alpha, path));
    opened.model_ = ndf;
    opened.info_ = {map.width, map.height, kReferenceResolution, ndf.sigma(), Surface::flat, Boundary::wrap, 0, 0, 0};
  } else if (asset.kind() == "histogram-sat") {
    opened.model_ = HistogramNdf(asset.get<HistogramSat>(), options.gaussian_boxes, options.slant_tolerance);
    opened.info_ = infoOf(asset.get<HistogramSat>());
  } else {
    throw Error(ErrorCode::unsupported, "format.kind", path.string(), "",
                "is of kind " + std::string(asset.kind()) + ", which holds no distribution of normals",
                asset.kind() == "displacement"
                    ? "ask for the light that it reflects, with DisplacedBrdf or glint_displaced_open"
                    : "pass an asset of kind normals, ndf-pyramid, ndf-cp, bin-map or histogram-sat");
  }
  if (opened.normals_) requireSameMap(asset, path, opened.info_, opened.normals_->get<NormalMap>(), options.normals);
  return opened;
}

MapSlopes OpenedNdf::slopes() const {
  return std::visit(Overloaded{[&](const Reference&) { return slopesOf(asset_.get<NormalMap>()); },
                               [](const AnisotropicNdf<PyramidNdf>& pyramid) { return pyramid.round().shape().slopes; },
                               [](const AnisotropicNdf<CpNdf>& compressed) { return compressed.round().shape().slopes; },
                               [](const BinMapNdf& bins) { return bins.map().slopes; },
                               [](const HistogramNdf& histograms) { return histograms.sat().slopes; }},
                    model_);
}

}  // namespace glint::api
