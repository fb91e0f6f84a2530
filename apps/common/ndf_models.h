#pragma once

#include <optional>
#include <string>
#include <vector>

#include "common/footprint_rules.h"
#include "common/tool.h"
#include "glint/api/any_ndf.h"

namespace glint::apps {

using api::AnyNdf;

/// Mix-in: the asset that a tool asks, and the options that say how. Normals are answered by Reference with --surface,
/// --sigma-r and --boundary; pyramids and compressed ones by their own parameters, and by Reference below level 0 where
/// --normals is given; bin maps by their own, at any size.
class NdfAsset {
 public:
  explicit NdfAsset(Tool& tool);

  /// Opens the asset, and warns of options that are for other kinds. Call once, in the work; the model lives as long as this
  /// object.
  /// @param checks  of the asset and of --normals, beyond those that opening always makes
  /// @throws Error invalid_input if --normals is not the map that the asset was made from
  void open(const formats::OpenOptions& checks = {});
  const std::string& path() const { return path_; }
  const AnyNdf& model() const { return opened_->model(); }

  /// Pixels along each axis of the asset's NDF images; 256 for normals.
  int resolution() const { return opened_->info().resolution; }

  const api::NdfInfo& info() const { return opened_->info(); }
  MapSlopes slopes() const { return opened_->slopes(); }
  /// Intrinsic roughness of the facets: the asset's own, or --sigma-r where it has none.
  float facetRoughness() const { return info().sigma_r > 0 ? info().sigma_r : options_.sigma_r; }

  /// The NDF image of a footprint where there is a faster way than asking for every pixel: normals of a flat surface.
  /// @return [size][size] pixel means, bottom row first
  std::optional<std::vector<float>> scatteredImage(const Footprint& footprint, int size) const;

  /// Why the asset cannot answer for a footprint without --normals; nothing if it can.
  std::optional<FootprintFault> unanswerable(const Footprint& footprint) const;

 private:
  /// An option that only some kinds of assets use.
  struct KindOption {
    std::vector<std::string> kinds;
    std::string name;
    const Option* option;
  };
  void useOnly(std::vector<std::string> kinds, const std::string& name, const Option& option);

  Tool& tool_;
  std::vector<KindOption> kind_options_;
  std::string path_;
  std::string normals_path_;
  api::NdfOptions options_;
  std::optional<api::OpenedNdf> opened_;
};

}  // namespace glint::apps
