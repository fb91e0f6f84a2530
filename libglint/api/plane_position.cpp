#include "glint/api/plane_position.h"

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

float densityAt(const NdfModels::Any& model, double u, double v, const Footprint& p, Vec2 h) {
  return isEndless(model) ? movedTo(model, u, v).density(p, h) : model.density(p, h);
}

float meanAt(const NdfModels::Any& model, double u, double v, const Footprint& p, const Box2& range) {
  return isEndless(model) ? movedTo(model, u, v).mean(p, range) : model.mean(p, range);
}

HalfVectorSample sampleAt(const NdfModels::Any& model, double u, double v, const Footprint& p, Vec2 xi) {
  return isEndless(model) ? movedTo(model, u, v).sample(p, xi) : model.sample(p, xi);
}

}  // namespace glint::api
