#pragma once

#include <span>
#include <string>
#include <vector>

namespace glint::apps {

/// Throws Error usage unless the name ends in .exr or .png.
void checkPictureName(const std::string& path);

/// Writes an NDF image. An .exr holds the densities, one float channel. A .png holds colours (inferno) of log(1 + density), from
/// 0 to the largest value of the image: the logarithm shows both sparse glints and broad lobes.
/// @param densities  [size][size], bottom row first
void writeNdfPicture(const std::string& path, int size, std::span<const float> densities);

/// Writes an NDF image in colour. An .exr holds red, green and blue, which may be below 0. A .png holds the hue of each pixel, cut at
/// 0, and the logarithm of its brightest channel as writeNdfPicture does.
/// @param rgb  [size][size][3], linear sRGB, bottom row first
void writeColourPicture(const std::string& path, int size, std::span<const float> rgb);

/// The colours of writeNdfPicture.
/// @param largest  density that gets the brightest colour
/// @return [size][size][3] in 0..1
std::vector<float> ndfColours(int size, std::span<const float> densities, float largest);

}  // namespace glint::apps
