#pragma once

#include <cstdint>
#include <span>
#include <string>
#include <vector>

#include "common/image_io.h"

namespace glint::apps {

/// The formats of OpenImageIO, in a shared object of their own: programs and inputs that do not need that library must not wait
/// until it and the hundreds that it links to are loaded.
struct ImageFormats {
  /// @throws Error invalid_input, unsupported
  Image (*read)(const std::string& path);
  /// The bytes of an image file. @throws Error usage, unsupported
  std::vector<unsigned char> (*encode)(const std::string& path, int width, int height, int channels,
                                       std::span<const float> pixels, PixelFormat format);
  bool (*isWritableName)(const std::string& path);
  /// The colours of the map "inferno" for values of 0..1. @param grey  [size][size] @return [size][size][3]
  std::vector<float> (*infernoColours)(int size, std::span<const float> grey);
};

/// Loads it on the first call.
/// @throws Error failed if the shared object is not where it was built or installed
const ImageFormats& imageFormats();

/// Reads a PNG without it.
/// @throws Error invalid_input if the file is damaged or truncated
Image readPng(const std::string& path);

/// Whether a file starts as every PNG does.
bool isPng(const std::string& path);

/// Refuses a header that declares far more than its file can hold, before memory is taken for it.
/// @throws Error invalid_input
void checkDeclaredSize(const std::string& path, std::uint64_t pixel_bytes);

[[noreturn]] void throwDamagedImage(const std::string& path, const std::string& reason);

}  // namespace glint::apps
