#pragma once

#include <cstdint>

namespace glint {

/// How a pyramid of NDF images answers a footprint between the centres and the sizes of its images.
enum class Interpolation : std::uint8_t {
  footprint,  ///< 16 images of one level, weighed so that together they see the footprint that is asked for; 32 between levels
  trilinear,  ///< 4 images of each of two levels (Deng 2022). Answers a wider footprint where centres are far apart
};

/// How the density of a pyramid of NDF images runs between half vectors of one pixel. The mass of every pixel is the same.
enum class Pixels : std::uint8_t {
  smooth,    ///< continuous, from the pixel and its eight neighbours (PixelSpline)
  constant,  ///< constant over a pixel: quicker, but small lights show the borders of pixels
};

}  // namespace glint
