#include "glint-query/directions.h"

#include <cmath>

#include "glint/model/error.h"

namespace glint::apps {

std::optional<Vec3> unitVector(Vec3 given) {
  const float length = std::sqrt(dot(given, given));
  if (!(length > 0 && std::isfinite(length))) return {};
  return 1 / length * given;
}

Vec3 directionOf(const std::vector<float>& xyz, const std::string& option) {
  if (const auto unit = unitVector({xyz[0], xyz[1], xyz[2]})) return *unit;
  throw Error(ErrorCode::usage, "query.arguments", "", option, "is no direction", kDirectionRemedy);
}

}  // namespace glint::apps
