#pragma once

#include <cstdint>
#include <filesystem>
#include <memory>
#include <optional>
#include <string_view>
#include <vector>

#include "glint/api/ndf_info.h"
#include "glint/api/ndf_models.h"
#include "glint/api/ndf_options.h"
#include "glint/formats/asset_reader.h"
#include "glint/query/brdf/smith.h"

namespace glint::api {

/// Any model of the NDF that an asset can hold, for footprints of any shape. A std::variant of them that is a model itself.
using AnyNdf = NdfModels::Any;
static_assert(NdfModel<AnyNdf>);

/// Whether assets of a kind answer an NDF.
bool answersNdf(std::string_view kind);

/// The kinds of assets that answer an NDF.
std::vector<std::string_view> ndfKinds();

/// Refuses a map that a pyramid was not made from, by the hash that the pyramid names. Where it names no map, only the sizes can be
/// compared.
/// @param asset, path            the pyramid, compressed or not
/// @param width, height          of its map, texels
/// @param map, normals_path      the map that is given, and its file
/// @throws Error invalid_input
void requireSameMap(const formats::Asset& asset, const std::filesystem::path& path, int width, int height, const NormalMap& map,
                    const std::filesystem::path& normals_path);

/// An asset and the model that answers from it, of whichever kind it is.
class OpenedNdf {
 public:
  /// Opens an asset of a kind that answers an NDF, or a UDIM set of them: `name.<UDIM>.glint` opens every tile that has a file, and
  /// the model is a UdimNdf. So it is for the file of one tile, which is a set of this tile. `options.normals` of a set is a pattern,
  /// too. A set answers as with Boundary::clamp.
  /// @throws Error  as formats::Asset::open; unsupported for other kinds; invalid_input if `options.normals` is not the map
  ///                that the asset was made from, by the hash that the asset names, or by size where it names none
  static OpenedNdf open(const std::filesystem::path& path, const NdfOptions& options = {});

  /// The same for an asset that is open, from memory for example. Messages call it `name`; `options.checks` is for
  /// `options.normals` only.
  static OpenedNdf open(formats::Asset asset, const std::filesystem::path& name, const NdfOptions& options = {});

  /// Points into the mapped asset: lives as long as this object, also when that is moved.
  const AnyNdf& model() const { return model_; }
  const NdfInfo& info() const { return info_; }
  /// The asset; of a UDIM set, that of its first tile.
  const formats::Asset& asset() const;
  /// Bytes of the asset, or of all tiles.
  std::uint64_t fileBytes() const;
  const std::filesystem::path& path() const { return path_; }
  /// Whether footprints below level 0 are answered from the texels: of `options.normals`, or of the normals that the asset keeps
  /// where `options.use_kept_normals` is set.
  bool hasNormals() const;
  /// The map of `options.normals`; nullptr if there is none, and for UDIM sets, which have one for each tile.
  const NormalMap* normals() const { return normals_ ? &normals_->get<NormalMap>() : nullptr; }
  /// Moments of the map's slopes, for SmithMasking. Kind normals: sums over all texels; other kinds hold them.
  MapSlopes slopes() const;
  /// Masking of a BRDF by the slopes of the map and the roughness of its facets. Costs as much as `slopes`: keep it.
  SmithMasking masking() const { return {slopes(), info_.sigma_r}; }

  /// What the model was made from, for functions of its traits. Points into this object.
  template <class Model>
  NdfSource<AssetOf<Model>> source() const {
    return {asset().get<AssetOf<Model>>(), options_, normals(), path_};
  }

 private:
  /// The tiles of a UDIM set.
  struct Set;

  OpenedNdf(std::filesystem::path path, const NdfOptions& options) : path_(std::move(path)), options_(options) {}
  static OpenedNdf openMap(formats::Asset asset, const std::filesystem::path& name, const NdfOptions& options);
  static OpenedNdf openSet(std::vector<OpenedNdf> maps, const std::filesystem::path& name, const NdfOptions& options);

  std::filesystem::path path_;
  NdfOptions options_;
  std::optional<formats::Asset> asset_;  // nothing of a set
  std::shared_ptr<const Set> set_;       // nothing but of a set
  std::optional<formats::Asset> normals_;
  AnyNdf model_;
  NdfInfo info_;
};

}  // namespace glint::api
