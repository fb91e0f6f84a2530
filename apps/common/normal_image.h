#pragma once

#include <span>
#include <string>
#include <vector>

#include "common/image_io.h"
#include "glint/math/vec.h"

namespace glint::apps {

/// Normals as colours: 0.5 + 0.5 n, green up.
/// @param normals  projections on the unit disk
/// @return three channels for each normal, each in [0, 1]
std::vector<float> encodeNormals(std::span<const Vec2> normals);

/// Bits of a channel for an image of this name: 8 for integer formats and 32 for floating-point ones unless `wanted` is not 0.
/// @throws Error usage if the format cannot hold so many bits
int pixelBits(const std::string& path, int wanted);

/// The pixel format of this many bits.
PixelFormat pixelFormat(const std::string& path, int bits);

/// Throws Error usage if floats are `needed` and the format of this name holds 0..1 only.
void requireFloatImage(const std::string& path, bool needed, const std::string& what);

}  // namespace glint::apps
