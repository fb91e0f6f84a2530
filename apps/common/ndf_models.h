#pragma once

#include <initializer_list>
#include <optional>
#include <string>
#include <string_view>
#include <vector>

#include "common/footprint_rules.h"
#include "common/tool.h"
#include "glint/api/any_ndf.h"

namespace glint::apps {

using api::AnyNdf;

/// The assets that a command asks.
struct AskedAssets {
  std::vector<std::string_view> kinds = api::ndfKinds();
  bool smooth_surfaces = true;  ///< whether normals may be asked as a smooth surface
  bool udim_sets = false;       ///< whether tiles of a UDIM set may be asked, as a set
};

/// Mix-in: the asset that a tool asks, and the options of the kinds that it asks. Reference answers normals, with --surface,
/// --sigma-r and --boundary. With --normals, ManifoldNdf answers footprints below level 0 of a pyramid.
class NdfAsset {
 public:
  explicit NdfAsset(Tool& tool, const AskedAssets& asked = {});

  /// Opens the asset, and warns of options for other kinds. Call once, in the work; the model lives as long as this object.
  /// @param checks  further checks of the asset and of --normals
  /// @throws Error invalid_input if --normals is not the map that the asset was made from; unsupported if the asset is of a
  ///               kind that is not asked
  void open(const formats::OpenOptions& checks = {});
  const std::string& path() const { return path_; }
  const AnyNdf& model() const { return opened_->model(); }

  /// Pixels along each axis of the asset's NDF images; 256 for normals.
  int resolution() const { return opened_->info().resolution; }

  const api::NdfInfo& info() const { return opened_->info(); }
  MapSlopes slopes() const { return opened_->slopes(); }
  /// Intrinsic roughness of the facets: the asset's own, or --sigma-r where it has none.
  float facetRoughness() const { return info().sigma_r > 0 ? info().sigma_r : options_.sigma_r; }

  /// Picture of a footprint in colour, of kinds wave-pyramid and wave-cp; nothing for other kinds.
  /// @return [size][size][3]: means of pixels in linear sRGB, bottom row first
  std::optional<std::vector<float>> colourImage(const Footprint& footprint, int size) const;

  /// The NDF image of a footprint where there is a faster way than asking for every pixel: normals of a flat surface.
  /// @return [size][size] pixel means, bottom row first
  std::optional<std::vector<float>> scatteredImage(const Footprint& footprint, int size) const;

  /// Why the asset cannot answer for a footprint without --normals; nothing if it can.
  std::optional<FootprintFault> unanswerable(const Footprint& footprint) const;

  /// How to have footprints below the finest level answered.
  std::string normalsRemedy() const;

  /// Whether the asset answers a wider footprint, for want of --normals.
  bool widens(const Footprint& footprint) const;

  /// Whether the asset is a UDIM set that has no tile at a place: answers are 0 there.
  bool lacksTileAt(double u, double v) const;

 private:
  void check();
  /// An option that only some kinds of assets use.
  struct KindOption {
    std::vector<std::string_view> kinds;
    std::string name;
    const Option* option;
  };
  void addImageOptions();
  void addNormalsOptions();
  void addPyramidOptions();
  void addBinOptions();
  bool asks(std::initializer_list<std::string_view> kinds) const;
  void useOnly(std::initializer_list<std::string_view> kinds, const std::string& name, const Option& option);
  void refuseOtherKinds() const;

  Tool& tool_;
  AskedAssets asked_;
  std::vector<KindOption> kind_options_;
  std::string path_;
  std::string normals_path_;
  api::NdfOptions options_;
  std::optional<api::OpenedNdf> opened_;
};

}  // namespace glint::apps
