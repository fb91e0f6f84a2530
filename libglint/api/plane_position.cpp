#include "glint/api/plane_position.h"

#include "glint/query/curved_ndf.h"

namespace glint::api {

NdfModels::Any movedTo(const NdfModels::Any& model, double u, double v) {
  return std::visit(
      [&]<class Model>(const Model& m) -> NdfModels::Any {
        if constexpr (EndlessNdf<Model>)
          return m.movedTo(planeCell(u), planeCell(v));
        else
          return m;
      },
      model);
}

namespace {

/// Calls ask with the model at a position, averaged over the half vectors of the pixel.
template <class Ask>
auto askAt(const NdfModels::Any& model, double u, double v, Vec2 spread, Ask&& ask) {
  if (!isEndless(model)) return ask(CurvedNdf(model, spread));
  const NdfModels::Any moved = movedTo(model, u, v);
  return ask(CurvedNdf(moved, spread));
}

}  // namespace

float densityAt(const NdfModels::Any& model, double u, double v, const Footprint& p, Vec2 h, Vec2 spread) {
  return askAt(model, u, v, spread, [&](const auto& m) { return m.density(p, h); });
}

float meanAt(const NdfModels::Any& model, double u, double v, const Footprint& p, const Box2& range, Vec2 spread) {
  return askAt(model, u, v, spread, [&](const auto& m) { return m.mean(p, range); });
}

HalfVectorSample sampleAt(const NdfModels::Any& model, double u, double v, const Footprint& p, Vec2 xi, Vec2 spread) {
  return askAt(model, u, v, spread, [&](const auto& m) { return m.sample(p, xi); });
}

}  // namespace glint::api
