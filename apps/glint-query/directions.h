#pragma once

#include <optional>
#include <string>
#include <vector>

#include "glint/math/vec.h"

namespace glint::apps {

/// The form of a direction, for messages.
inline constexpr const char* kDirectionRemedy = "give X Y Z, z out of the surface";

/// A direction of any length above 0 as a unit vector; nothing if it has none.
std::optional<Vec3> unitVector(Vec3 given);

/// The direction that an option gives, as a unit vector.
/// @throws Error usage if it has no length
Vec3 directionOf(const std::vector<float>& xyz, const std::string& option);

}  // namespace glint::apps
