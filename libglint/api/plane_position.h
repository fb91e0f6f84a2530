#pragma once

#include <cmath>
#include <concepts>
#include <cstdint>
#include <variant>

#include "glint/api/batch.h"
#include "glint/api/ndf_models.h"

namespace glint::api {

/// The cell of a plane that holds a coordinate; numbers that are not finite, or beyond 2^62, are in cell 0. wrappedUv gives the
/// position in the cell.
inline std::int64_t planeCell(double u) {
  constexpr double kFarthest = 0x1p62;
  return std::fabs(u) < kFarthest ? static_cast<std::int64_t>(std::floor(u)) : 0;
}

/// A model of a plane without end, which can be seen from any of its cells.
template <class Model>
concept EndlessNdf = requires(const Model& model, std::int64_t cell) {
  { model.movedTo(cell, cell) } -> std::same_as<Model>;
};

/// Whether a model is one of a plane without end: then the whole parts of the centre of a footprint count.
inline bool isEndless(const NdfModels::Any& model) {
  return std::visit([]<class Model>(const Model&) { return EndlessNdf<Model>; }, model);
}

/// The model for questions at one position. A plane without end is moved so that its cell there is cell 0: the footprint of a
/// question has its centre at wrappedUv(u, v). Maps repeat, so that they need no move.
NdfModels::Any movedTo(const NdfModels::Any& model, double u, double v);

/// Answers to one question at a position, of the model that movedTo gives.
/// @param spread  on a curved surface, half widths of the box of half vectors that the pixel sees (CurvedNdf)
float densityAt(const NdfModels::Any& model, double u, double v, const Footprint& p, Vec2 h, Vec2 spread = {});
float meanAt(const NdfModels::Any& model, double u, double v, const Footprint& p, const Box2& range, Vec2 spread = {});
HalfVectorSample sampleAt(const NdfModels::Any& model, double u, double v, const Footprint& p, Vec2 xi, Vec2 spread = {});

/// The model for query k of a batch: moved where centres are given precisely.
inline NdfModels::Any movedTo(const NdfModels::Any& model, const FootprintArrays& footprints, std::size_t k) {
  return footprints.precise_u.data == nullptr ? model : movedTo(model, footprints.precise_u[k], footprints.precise_v[k]);
}

}  // namespace glint::api
