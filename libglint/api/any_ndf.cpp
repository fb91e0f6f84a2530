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

/// Where an asset names no map, only the sizes can be compared.
void requireSameMap(const formats::Asset& asset, const std::filesystem::path& path, const NdfInfo& info, const NormalMap& map,
                    const std::filesystem::path& normals_path) {
  const std::vector<formats::InputRecord> maps = mapsOf(asset);
  const std::string hash = maps.empty() ? std::string() : formats::hashFile(normals_path);
  const bool named =
      maps.empty() || std::any_of(maps.begin(), maps.end(), [&](const auto& input) { return input.hash_hex == hash; });
  if (named && map.width == info.width && map.height == info.height) return;
  std::string remedy = "give the asset that glint-pyramid read";
  if (!maps.empty())
    remedy += ", " + maps.front().name.substr(maps.front().name.rfind('/') + 1) + ", as it was then (hash " +
              maps.front().hash_hex + "), or make the pyramid again from this one";
  throw Error(ErrorCode::invalid_input, "query.normals", normals_path.string(), "",
              "this is not the map that " + path.string() + " was made from", remedy);
}

[[noreturn]] void refuseKind(std::string_view kind, const std::filesystem::path& path) {
  throw Error(ErrorCode::unsupported, "format.kind", path.string(), "",
              "is of kind " + std::string(kind) + ", which holds no distribution of normals",
              kind == "ndf-pyramid-shard" ? std::string(formats::kJoinShards)
              : kind == "displacement"    ? "ask for the light that it reflects, with DisplacedBrdf or glint_displaced_open"
                                          : "pass an asset of kind " + alternatives(ndfKinds()));
}

}  // namespace

bool answersNdf(std::string_view kind) {
  const std::vector<std::string_view> kinds = ndfKinds();
  return std::find(kinds.begin(), kinds.end(), kind) != kinds.end();
}

std::vector<std::string_view> ndfKinds() {
  std::vector<std::string_view> kinds;
  NdfModels::forEach([&]<class Model>(std::type_identity<Model>) { kinds.push_back(NdfTraits<Model>::kKind); });
  return kinds;
}

OpenedNdf OpenedNdf::open(const std::filesystem::path& path, const NdfOptions& options) {
  return open(formats::Asset::open(path, options.checks), path, options);
}

OpenedNdf OpenedNdf::open(formats::Asset asset, const std::filesystem::path& path, const NdfOptions& options) {
  OpenedNdf opened(std::move(asset), path, options);
  if (!options.normals.empty()) opened.normals_ = formats::Asset::open(options.normals, options.checks);
  const std::string_view kind = opened.asset_.kind();
  if (!answersNdf(kind)) refuseKind(kind, path);
  NdfModels::forEach([&]<class Model>(std::type_identity<Model>) {
    if (kind != NdfTraits<Model>::kKind) return;
    const auto source = opened.source<Model>();
    opened.model_ = NdfTraits<Model>::open(source);
    opened.info_ = NdfTraits<Model>::info(source);
  });
  if (opened.normals_) requireSameMap(opened.asset_, path, opened.info_, opened.normals_->get<NormalMap>(), options.normals);
  return opened;
}

MapSlopes OpenedNdf::slopes() const {
  return std::visit([&]<class Model>(const Model&) { return NdfTraits<Model>::slopes(asset_.get<AssetOf<Model>>()); }, model_);
}

}  // namespace glint::api
