#pragma once

#include <cstddef>
#include <cstdint>

namespace glint::bake {

/// Converts IEEE halves to floats, in SIMD of the best instruction set of the machine.
/// @param in     [count] halves; infinities and NaNs stay what they are
/// @param count  a multiple of 8
/// @param out    [count]
void halvesToFloats(const std::uint16_t* in, std::size_t count, float* out);

}  // namespace glint::bake
