#pragma once

#include <concepts>
#include <filesystem>
#include <string_view>

#include "glint/api/ndf_info.h"
#include "glint/api/ndf_options.h"
#include "glint/api/packer.h"
#include "glint/formats/kinds.h"
#include "glint/model/normal_map.h"
#include "glint/query/ndf_model.h"

namespace glint::api {

/// An asset and the way it is asked: all that a model is made from.
template <class Asset>
struct NdfSource {
  const Asset& asset;
  const NdfOptions& options;
  const NormalMap* normals = nullptr;  ///< map for footprints below level 0; nullptr: none
  std::filesystem::path path = {};     ///< of the asset, for messages
};

/// All that the library has to know of a model beyond its questions. Every model of ndf_models.h has a specialization in a file
/// of its own, beside this one. DescribedNdf lists the members:
///
///   Asset           struct of the kind that the model answers, e.g. BinMap
///   kKind           name of the kind, formats::kKindName<Asset>
///   open(source)    makes the model. Throws Error (usage) for options that the asset cannot answer
///   info(source)    properties of the model that open(source) makes
///   slopes(asset)   moments of the map's slopes, for SmithMasking
///   kPacks          whether the model has a packed form (glint/model/packed_ndf.h)
///   pack(source, packer)  where kPacks is true: fills the header, and appends the arrays in its order
///
/// Functions take the struct of an asset and not its file, so that a model which is made of others can open them.
template <class Model>
struct NdfTraits;

/// The asset that a model answers.
template <class Model>
using AssetOf = typename NdfTraits<Model>::Asset;

/// A model whose traits are complete.
template <class M>
concept DescribedNdf = NdfModel<M> && requires(const NdfSource<AssetOf<M>>& source) {
  { NdfTraits<M>::kKind } -> std::same_as<const std::string_view&>;
  { NdfTraits<M>::open(source) } -> std::same_as<M>;
  { NdfTraits<M>::info(source) } -> std::same_as<NdfInfo>;
  { NdfTraits<M>::slopes(source.asset) } -> std::same_as<MapSlopes>;
  { NdfTraits<M>::kPacks } -> std::same_as<const bool&>;
} &&(!NdfTraits<M>::kPacks ||
     requires(const NdfSource<AssetOf<M>>& source, Packer& packer) { NdfTraits<M>::pack(source, packer); });

}  // namespace glint::api
