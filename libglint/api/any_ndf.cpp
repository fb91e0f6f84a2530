#include "glint/api/any_ndf.h"

#include <algorithm>
#include <string>
#include <utility>
#include <vector>

#include "glint/api/alternatives.h"
#include "glint/formats/hash.h"
#include "glint/formats/rules.h"

namespace glint::api {

template class OneOfNdfs<NdfModels>;

namespace {

/// The inputs that may be the map of an asset. A pyramid names its map as an input. A compressed pyramid names the map as an input
/// of the pyramid.
std::vector<formats::InputRecord> mapsOf(const formats::Asset& asset) {
  const bool pyramid = asset.kind() == "ndf-pyramid";
  std::vector<formats::InputRecord> maps;
  for (const formats::InputRecord& input : asset.info().provenance.inputs)
    if (pyramid || formats::isChained(input)) maps.push_back(input);
  return maps;
}

[[noreturn]] void refuseKind(std::string_view kind, const std::filesystem::path& path) {
  throw Error(ErrorCode::unsupported, "format.kind", path.string(), "",
              "is of kind " + std::string(kind) + ", which holds no distribution of normals",
              kind == "ndf-pyramid-shard" ? std::string(formats::kJoinShards)
              : kind == "displacement"    ? "ask for the light that it reflects, with DisplacedBrdf or glint_displaced_open"
                                          : "pass an asset of kind " + alternatives(ndfKinds()));
}

}  // namespace

void requireSameMap(const formats::Asset& asset, const std::filesystem::path& path, int width, int height, const NormalMap& map,
                    const std::filesystem::path& normals_path) {
  const std::vector<formats::InputRecord> maps = mapsOf(asset);
  const std::string hash = maps.empty() ? std::string() : formats::hashFile(normals_path);
  const bool named =
      maps.empty() || std::any_of(maps.begin(), maps.end(), [&](const auto& input) { return input.hash_hex == hash; });
  if (named && map.width == width && map.height == height) return;
  std::string remedy = "give the asset that glint-pyramid read";
  if (!maps.empty())
    remedy += ", " + maps.front().name.substr(maps.front().name.rfind('/') + 1) + ", as it was then (hash " +
              maps.front().hash_hex + "), or make the pyramid again from this one";
  throw Error(ErrorCode::invalid_input, "query.normals", normals_path.string(), "",
              "this is not the map that " + path.string() + " was made from", remedy);
}

bool answersNdf(std::string_view kind) {
  const std::vector<std::string_view> kinds = ndfKinds();
  return std::find(kinds.begin(), kinds.end(), kind) != kinds.end();
}

std::vector<std::string_view> ndfKinds() {
  std::vector<std::string_view> kinds;
  NdfModels::forEach([&]<class Model>(std::type_identity<Model>) { kinds.push_back(NdfTraits<Model>::kKind); });
  return kinds;
}

struct OpenedNdf::Set {
  explicit Set(std::vector<OpenedNdf> opened) : maps(std::move(opened)), tiles(tilesOf(maps)) {}
  static std::vector<UdimTile> tilesOf(const std::vector<OpenedNdf>& maps);

  std::vector<OpenedNdf> maps;  // one for each tile
  UdimTiles tiles;              // points into maps
};

namespace {

/// The options of one tile: it ends at its margins, and has a map of its own.
NdfOptions tileOptions(NdfOptions options, int tile) {
  options.boundary = Boundary::clamp;
  if (!options.normals.empty()) options.normals = formats::udimFile(options.normals, tile);
  return options;
}

formats::UdimPlace placeOf(const formats::Asset& asset, const std::filesystem::path& path) {
  if (asset.info().udim) return *asset.info().udim;
  throw Error(ErrorCode::invalid_input, "udim.tile", path.string(), "", "is no tile of a UDIM set, but a map of its own",
              "make the tiles together, from the images on: glint-ingest 'name.<UDIM>.exr' -o 'name.<UDIM>.map.glint'");
}

/// Refuses a file whose name is that of another tile.
void requireTile(const formats::Asset& asset, const std::filesystem::path& path, int tile) {
  const formats::UdimPlace place = placeOf(asset, path);
  if (place.tile == tile) return;
  throw Error(ErrorCode::invalid_input, "udim.tile", path.string(), "",
              "holds tile " + std::to_string(place.tile) + ", and its name says " + std::to_string(tile),
              "give the file the name that it was made with, or make it again");
}

/// The models that tiles can have.
using TileModels = NdfModelList<Reference, AnisotropicNdf<PyramidNdf>, AnisotropicNdf<CpNdf>, MomentsNdf>;

/// Refuses tiles whose model does not answer a map of margins.
void requireTileModel(const OpenedNdf& tile) {
  std::vector<std::string_view> kinds;
  TileModels::forEach([&]<class Model>(std::type_identity<Model>) { kinds.push_back(NdfTraits<Model>::kKind); });
  const std::string_view kind = tile.asset().kind();
  if (std::find(kinds.begin(), kinds.end(), kind) != kinds.end()) return;
  throw Error(ErrorCode::unsupported, "udim.kind", tile.path().string(), "",
              "is a tile of kind " + std::string(kind) + ", and no such tiles are answered as a set",
              "make tiles of kind " + alternatives(kinds));
}

/// What a set is: as its first tile, with the sizes of the largest tile and the widest of the smallest footprints.
NdfInfo setInfo(const UdimTiles& set, const std::vector<OpenedNdf>& maps) {
  NdfInfo info = maps.front().info();
  info.width = set.width(), info.height = set.height();
  info.boundary = Boundary::clamp;
  info.finest_sigma_texels = info.coarsest_sigma_texels = info.smallest_sigma_texels = 0;
  for (std::size_t k = 0; k < maps.size(); ++k) {
    const UdimTile& tile = set.tiles()[k];
    const float scale = static_cast<float>(set.width()) / static_cast<float>(tile.place.tileWidth(tile.width));
    const NdfInfo& one = maps[k].info();
    info.finest_sigma_texels = std::max(info.finest_sigma_texels, scale * one.finest_sigma_texels);
    info.coarsest_sigma_texels = std::max(info.coarsest_sigma_texels, scale * one.coarsest_sigma_texels);
    info.smallest_sigma_texels = std::max(info.smallest_sigma_texels, scale * one.smallest_sigma_texels);
  }
  return info;
}

/// Moments of the slopes of several maps of one area.
MapSlopes meanSlopes(const std::vector<OpenedNdf>& maps) {
  double n = static_cast<double>(maps.size()), x = 0, y = 0, xx = 0, xy = 0, yy = 0;
  for (const OpenedNdf& map : maps) {
    const MapSlopes slopes = map.slopes();
    const double mx = slopes.mean.x, my = slopes.mean.y;
    x += mx / n, y += my / n;
    xx += (slopes.covariance.xx + mx * mx) / n, xy += (slopes.covariance.xy + mx * my) / n;
    yy += (slopes.covariance.yy + my * my) / n;
  }
  MapSlopes mean;
  mean.mean = {static_cast<float>(x), static_cast<float>(y)};
  mean.covariance = {static_cast<float>(std::max(0.0, xx - x * x)), static_cast<float>(xy - x * y),
                     static_cast<float>(std::max(0.0, yy - y * y))};
  return mean;
}

}  // namespace

OpenedNdf OpenedNdf::open(const std::filesystem::path& path, const NdfOptions& options) {
  if (!formats::isUdimPattern(path)) return open(formats::Asset::open(path, options.checks), path, options);
  if (!options.normals.empty() && !formats::isUdimPattern(options.normals))
    throw Error(ErrorCode::usage, "udim.normals", options.normals.string(), "", "is one map, and a set has one for each tile",
                "name the maps by a pattern, too, such as name.<UDIM>.map.glint");
  std::vector<OpenedNdf> maps;
  for (const int tile : formats::udimTiles(path)) {
    const std::filesystem::path file = formats::udimFile(path, tile);
    formats::Asset asset = formats::Asset::open(file, options.checks);
    requireTile(asset, file, tile);
    maps.push_back(openMap(std::move(asset), file, tileOptions(options, tile)));
  }
  return openSet(std::move(maps), path, options);
}

OpenedNdf OpenedNdf::open(formats::Asset asset, const std::filesystem::path& path, const NdfOptions& options) {
  if (!asset.info().udim) return openMap(std::move(asset), path, options);
  const int tile = asset.info().udim->tile;
  std::vector<OpenedNdf> maps;
  maps.push_back(openMap(std::move(asset), path, tileOptions(options, tile)));
  return openSet(std::move(maps), path, options);
}

OpenedNdf OpenedNdf::openMap(formats::Asset asset, const std::filesystem::path& path, const NdfOptions& options) {
  OpenedNdf opened(path, options);
  opened.asset_ = std::move(asset);
  if (!options.use_kept_normals) opened.asset_->leaveOutNearNormals();
  if (!options.normals.empty()) opened.normals_ = formats::Asset::open(options.normals, options.checks);
  const std::string_view kind = opened.asset_->kind();
  if (!answersNdf(kind)) refuseKind(kind, path);
  NdfModels::forEach([&]<class Model>(std::type_identity<Model>) {
    if (kind != NdfTraits<Model>::kKind) return;
    const auto source = opened.source<Model>();
    opened.model_ = NdfTraits<Model>::open(source);
    opened.info_ = NdfTraits<Model>::info(source);
  });
  if (opened.normals_)
    requireSameMap(*opened.asset_, path, opened.info_.width, opened.info_.height, opened.normals_->get<NormalMap>(),
                   options.normals);
  return opened;
}

std::vector<UdimTile> OpenedNdf::Set::tilesOf(const std::vector<OpenedNdf>& maps) {
  std::vector<UdimTile> tiles;
  for (const OpenedNdf& map : maps) {
    const std::string_view kind = map.asset().kind(), first = maps.front().asset().kind();
    if (kind != first)
      throw Error(ErrorCode::invalid_input, "udim.kind", map.path().string(), "",
                  "is of kind " + std::string(kind) + ", and the first tile of kind " + std::string(first),
                  "make all tiles by the same tool");
    const formats::UdimPlace place = placeOf(map.asset(), map.path());
    requireTileModel(map);
    tiles.push_back({place, map.info().width, map.info().height, &map.model()});
  }
  return tiles;
}

OpenedNdf OpenedNdf::openSet(std::vector<OpenedNdf> maps, const std::filesystem::path& path, const NdfOptions& options) {
  OpenedNdf opened(path, options);
  const auto set = std::make_shared<Set>(std::move(maps));
  opened.model_ = UdimNdf(set->tiles);
  opened.info_ = setInfo(set->tiles, set->maps);
  opened.set_ = set;
  return opened;
}

const formats::Asset& OpenedNdf::asset() const { return set_ ? set_->maps.front().asset() : *asset_; }

std::uint64_t OpenedNdf::fileBytes() const {
  if (!set_) return asset_->info().file_bytes;
  std::uint64_t bytes = 0;
  for (const OpenedNdf& map : set_->maps) bytes += map.fileBytes();
  return bytes;
}

bool OpenedNdf::hasNormals() const {
  if (set_) return std::all_of(set_->maps.begin(), set_->maps.end(), [](const OpenedNdf& map) { return map.hasNormals(); });
  if (normals_) return true;
  return std::visit(
      [](const auto& model) {
        if constexpr (requires { model.round().hasNormals(); })
          return model.round().hasNormals();
        else
          return false;
      },
      model_);
}

MapSlopes OpenedNdf::slopes() const {
  return std::visit(
      [&]<class Model>(const Model&) {
        if constexpr (std::is_same_v<Model, UdimNdf>)
          return meanSlopes(set_->maps);
        else
          return NdfTraits<Model>::slopes(asset_->get<AssetOf<Model>>());
      },
      model_);
}

}  // namespace glint::api
