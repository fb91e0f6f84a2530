#pragma once

#include <type_traits>
#include <variant>

#include "glint/api/models/ndf_traits.h"

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

/// The variant of some models and one more.
template <class Variant, class Model>
struct VariantExtension;
template <class... Models, class Model>
struct VariantExtension<std::variant<Models...>, Model> {
  using Type = std::variant<Models..., Model>;
};
template <class Variant, class Model>
using ExtendedVariant = typename VariantExtension<Variant, Model>::Type;

}  // namespace glint::api
