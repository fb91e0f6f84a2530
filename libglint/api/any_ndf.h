#pragma once

#include <filesystem>
#include <optional>
#include <variant>

#include "glint/formats/asset_reader.h"
#include "glint/query/anisotropic_ndf.h"
#include "glint/query/bin_map_ndf.h"
#include "glint/query/cp_ndf.h"
#include "glint/query/histogram_ndf.h"
#include "glint/query/pyramid_ndf.h"
#include "glint/query/reference.h"

namespace glint::api {

/// Any model of the NDF that an asset can hold, for footprints of any shape.
using AnyNdf = std::variant<Reference, AnisotropicNdf<PyramidNdf>, AnisotropicNdf<CpNdf>, BinMapNdf, HistogramNdf>;

/// The model of round footprints in it; nullptr if there is none of this kind.
template <class Model>
const Model* roundModel(const AnyNdf& ndf) {
  const auto* stretched = std::get_if<AnisotropicNdf<Model>>(&ndf);
  return stretched ? &stretched->round() : nullptr;
}

/// A visitor of a variant from one function for each alternative: one that is missing does not compile.
template <class... F>
struct Overloaded : F... {
  using F::operator()...;
};
template <class... F>
Overloaded(F...) -> Overloaded<F...>;

/// What an asset does not say itself about how it is asked.
struct NdfOptions {
  std::filesystem::path normals;       ///< asset that the pyramid was made from, for footprints below level 0; empty: none
  Surface surface = Surface::flat;     ///< kind normals: how they behave between texels
  Boundary boundary = Boundary::wrap;  ///< kind normals: beyond the border of the map
  float sigma_r = 0.005f;              ///< kind normals: intrinsic roughness, disk units
  float alpha = 0;                     ///< kind bin-map: Beckmann roughness, in the range of the asset; 0: the smallest
  GaussianBoxes gaussian_boxes = GaussianBoxes::one;  ///< kind histogram-sat: boxes that stand for a Gaussian footprint
  float slant_tolerance = kSlantTolerance;      ///< kind histogram-sat: share of a slanted footprint that may be misplaced
  int footprint_parts = IsotropicParts::kMost;  ///< kinds ndf-pyramid and ndf-cp: most round footprints that stand for a
                                                ///< stretched one; 1: one of the same mean square size
  /// Also compare every dataset with its hash, and bytes between objects with 0; reads the whole file.
  bool verify_hashes = false;
  bool check_values = false;  ///< also check values (finite, in the disk, ...); reads the whole file
};

/// What models of every kind have in common.
struct NdfInfo {
  int width = 0;       ///< of the normal map, texels
  int height = 0;      ///< of the normal map, texels
  int resolution = 0;  ///< pixels of an NDF image along each axis; 256 where the model has none
  float sigma_r = 0;   ///< intrinsic roughness, disk units; 0 where the model has none
  Surface surface = Surface::flat;
  Boundary boundary = Boundary::wrap;
  int level_count = 0;            ///< footprint sizes that are stored; 0: every size is answered from the texels or their sums
  float finest_sigma_texels = 0;  ///< deviation of the footprints of level 0; 0 where there are no levels
  /// Deviation of the footprints of the last level; larger ones tend to the mean of the map. 0 where there are no levels.
  float coarsest_sigma_texels = 0;
};

/// An asset and the model that answers from it, of whichever kind it is.
class OpenedNdf {
 public:
  /// Opens an asset of a kind that answers an NDF.
  /// @throws Error  as formats::Asset::open; unsupported for other kinds; invalid_input if `options.normals` is not the map
  ///                that the asset was made from, by the hash that the asset names, or by size where it names none
  static OpenedNdf open(const std::filesystem::path& path, const NdfOptions& options = {});

  /// Points into the mapped asset: lives as long as this object, also when that is moved.
  const AnyNdf& model() const { return model_; }
  const NdfInfo& info() const { return info_; }
  const formats::Asset& asset() const { return asset_; }
  const std::filesystem::path& path() const { return path_; }
  /// Whether footprints below level 0 are answered from the texels.
  bool hasNormals() const { return normals_.has_value(); }
  /// The map that answers them; nullptr if there is none.
  const NormalMap* normals() const { return normals_ ? &normals_->get<NormalMap>() : nullptr; }
  /// Moments of the map's slopes, for SmithMasking. Kind normals: sums over all texels; other kinds hold them.
  MapSlopes slopes() const;

 private:
  OpenedNdf(std::filesystem::path path, formats::Asset asset) : path_(std::move(path)), asset_(std::move(asset)) {}
  template <class Model, class View>
  void setPyramid(const View& view, int footprint_parts);

  std::filesystem::path path_;
  formats::Asset asset_;
  std::optional<formats::Asset> normals_;
  AnyNdf model_;
  NdfInfo info_;
};

}  // namespace glint::api
