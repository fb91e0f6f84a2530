#pragma once

#include <type_traits>
#include <variant>

#include "glint/api/models/bin_map.h"
#include "glint/api/models/compressed.h"
#include "glint/api/models/histogram.h"
#include "glint/api/models/moments.h"
#include "glint/api/models/pyramid.h"
#include "glint/api/models/reference.h"
#include "glint/api/models/tiny.h"
#include "glint/api/models/wang.h"
#include "glint/api/models/wave.h"

namespace glint::api {

/// One of several models, and a model itself: it answers as the model that it holds, so that it fits wherever a template takes
/// an NdfModel. Its questions choose the model once each; std::visit chooses it once for many questions.
/// @tparam List  an NdfModelList
template <class List>
class OneOfNdfs : public List::Variant {
 public:
  using Variant = typename List::Variant;
  using Variant::Variant;

  float density(const Footprint& p, Vec2 h) const;
  float mean(const Footprint& p, const Box2& range) const;
  HalfVectorSample sample(const Footprint& p, Vec2 xi) const;
};

template <class List>
float OneOfNdfs<List>::density(const Footprint& p, Vec2 h) const {
  return std::visit([&](const auto& model) { return model.density(p, h); }, *this);
}
template <class List>
float OneOfNdfs<List>::mean(const Footprint& p, const Box2& range) const {
  return std::visit([&](const auto& model) { return model.mean(p, range); }, *this);
}
template <class List>
HalfVectorSample OneOfNdfs<List>::sample(const Footprint& p, Vec2 xi) const {
  return std::visit([&](const auto& model) { return model.sample(p, xi); }, *this);
}

/// A list of models. A model whose traits lack a member cannot be in it.
template <DescribedNdf... Models>
struct NdfModelList {
  using Variant = std::variant<Models...>;
  /// Any model of the list.
  using Any = OneOfNdfs<NdfModelList>;

  /// Calls visit(std::type_identity<Model>{}) for each model.
  template <class Visit>
  static void forEach(Visit&& visit) {
    (visit(std::type_identity<Models>{}), ...);
  }
};

/// Every model that an asset can hold, for footprints of any shape. A new model is a line here and a file of traits in models/:
/// opening, the C interface, packing, the tools, and the tests of all models take it from here.
///
/// A plane of tiles is a line for each form of its tiles. A plane of tiles of several models holds them as a variant over a list of
/// these models, and visits the variant once in each question, after it has chosen the tile: its models do not multiply it.
using NdfModels =
    NdfModelList<Reference, AnisotropicNdf<PyramidNdf>, AnisotropicNdf<CpNdf>, BinMapNdf, HistogramNdf, MomentsNdf,
                 TinyExampleNdf, WangReference, WangPlane<PyramidTiles>, WangPlane<CompressedTiles>, AnisotropicNdf<WaveNdf>>;

/// Compiled once, in any_ndf.cpp: the models are large.
extern template class OneOfNdfs<NdfModels>;

}  // namespace glint::api
