#pragma once

#include <string>
#include <vector>

#include "common/image_io.h"
#include "common/tool.h"

namespace glint::apps {

/// Mix-in: which pixels of an image file are meant (--subimage, --layer, --channels, --alpha, --window).
class ImageOptions {
 public:
  /// Declares the options. Values land in this object, which must outlive the run.
  void declare(Tool& tool);
  const ImageChoice& choice() const { return choice_; }

 private:
  ImageChoice choice_;
};

/// Reads the first channel of an image that has one number from 0 to 1 for each texel of a map, such as its roughness.
/// @param width, height  of the map, texels
/// @param reason         why numbers may not be outside 0..1: a clause, for the remedy of the error
/// @throws Error invalid_input if the image has another size, pixels missing or transparent, or values that are not finite or
///         outside 0..1
std::vector<float> readUnitChannel(Tool& tool, const std::string& path, int width, int height, const std::string& reason);

/// Throws Error invalid_input unless an image has this size.
void requireSize(const std::string& path, const Image& image, int width, int height);
/// Throws Error invalid_input at the first of an image's values that is not in 0..1.
void requireUnitRange(const std::string& path, const std::vector<float>& values, int channels, int width, int height,
                      const std::string& reason);

/// Reads an image as readImage does. Warns of other images and layers in the file, and of pixels that were cut off.
Image readInputImage(Tool& tool, const std::string& path, const ImageChoice& choice = {});

}  // namespace glint::apps
