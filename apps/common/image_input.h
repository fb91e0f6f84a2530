#pragma once

#include <string>

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

/// Reads an image as readImage does. Warns of other images and layers in the file, and of pixels that were cut off.
Image readInputImage(Tool& tool, const std::string& path, const ImageChoice& choice = {});

}  // namespace glint::apps
