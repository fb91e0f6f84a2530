#pragma once

#include <optional>
#include <string>
#include <variant>
#include <vector>

#include "common/tool.h"
#include "glint/formats/asset_reader.h"
#include "glint/query/cp_ndf.h"
#include "glint/query/pyramid_ndf.h"
#include "glint/query/reference.h"

namespace glint::apps {

/// Any model of the NDF that an asset can hold.
using AnyNdf = std::variant<Reference, PyramidNdf, CpNdf>;

/// Mix-in: the asset that a tool asks, and the options that say how. Normals are answered by Reference with --surface, --sigma-r and
/// --boundary; pyramids and compressed ones by their own parameters, and by Reference below level 0 where --normals is given.
class NdfAsset {
 public:
  explicit NdfAsset(Tool& tool);

  /// Opens the asset. Call once, in the work; the model points into this object.
  /// @throws Error invalid_input if --normals is not the map that the asset was made from
  void open();
  const AnyNdf& model() const { return *model_; }

  /// Pixels along each axis of the asset's NDF images; 256 for normals.
  int resolution() const;

  /// The NDF image of a footprint where there is a faster way than asking for every pixel: normals of a flat surface.
  /// @return [size][size] pixel means, bottom row first
  std::optional<std::vector<float>> scatteredImage(const Footprint& footprint, int size) const;

  /// Throws Error usage for footprints that the asset cannot answer without --normals.
  void requireAnswerable(const Footprint& footprint) const;

 private:
  void requireSameMap(const PyramidShape& shape, const formats::AssetInfo& info) const;

  const Tool& tool_;
  std::string path_;
  std::string normals_path_;
  Surface surface_ = Surface::flat;
  Boundary boundary_ = Boundary::wrap;
  float sigma_r_ = 0.005f;
  std::optional<formats::Asset> asset_;
  std::optional<formats::Asset> normals_;
  std::optional<AnyNdf> model_;
};

}  // namespace glint::apps
