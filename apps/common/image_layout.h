#pragma once

#include <string>

#include "common/image_formats.h"

/// The steps from an image as a file stores it to the image that is meant.
namespace glint::apps {

/// Cuts the display window out of the pixels. What was cut off is noted.
/// @throws Error invalid_input if the display window has pixels that are not stored
void cropToDisplay(StoredImage& stored, const ImageChoice& choice, const std::string& path);

/// Turns and mirrors the pixels as the orientation says.
void orient(StoredImage& stored);

/// "normal" of "normal.X", "" of "R".
inline std::string layerOf(const std::string& channel) {
  const std::size_t point = channel.rfind('.');
  return point == std::string::npos ? "" : channel.substr(0, point);
}

/// Keeps the channels of one layer: their names start with the layer's name and a point.
/// @param layer  name, or name of the part that was read; empty: the layer of the first channel
/// @throws Error invalid_input if there is no such layer
void selectLayer(Image& image, const std::string& layer, const std::string& path);

/// Numbers of the channels that are meant: names with commas between them, or letters. A letter is the channel of this name,
/// else one by its place: r and x are the first, g and y the second, b and z the third, a the fourth. In an image of grey and
/// alpha, r, g and b are grey.
/// @throws Error invalid_input if one is missing
std::vector<int> findChannels(const Image& image, const std::string& channels, const std::string& path);

/// Keeps these channels, in this order.
void selectChannels(Image& image, const std::vector<int>& channels);

/// Divides the other channels by alpha; integers become floats. Where alpha is 1 everywhere nothing changes.
/// @throws Error invalid_input if the colours cannot have been multiplied by alpha, or if alpha 0 destroyed colours and these are
///         not to become NaN (ImageChoice::transparent_holes)
void divideByAlpha(Image& image, const ImageChoice& choice, const std::string& path);

}  // namespace glint::apps
