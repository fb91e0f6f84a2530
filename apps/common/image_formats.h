#pragma once

#include <cstdint>
#include <span>
#include <string>
#include <vector>

#include "common/image_io.h"

namespace glint::apps {

/// An image as its file stores it, bottom row first, and what the file says about showing it.
struct StoredImage {
  Image image;
  int orientation = 1;  ///< 1 to 8, as in Exif
  /// The display window. Its first column and row (from the top) count from the first column and row of the pixels.
  struct {
    std::int64_t column = 0, row = 0, width = 0, height = 0;
  } display;
};

/// A level of a texture with levels: its pixels, bottom row first.
struct MipLevel {
  int width = 0;
  int height = 0;
  std::vector<float> pixels;  ///< [height][width][channels]
};

/// The formats of OpenImageIO, in a shared object of their own: programs and inputs that do not need that library must not wait
/// until it and the hundreds that it links to are loaded.
struct ImageFormats {
  const char* version;  ///< of the project. Programs and the shared object must be of one version
  /// @throws Error invalid_input, unsupported
  /// @param part   number (from 0) or name of one of several images; empty: the one that has the layer, or the first
  /// @param layer  empty: any
  /// @param most_bytes  of pixels, as checkDeclaredSize() has it
  StoredImage (*read)(const std::string& path, const std::string& part, const std::string& layer, std::uint64_t most_bytes);
  /// The bytes of an image file. @throws Error usage, unsupported
  std::vector<unsigned char> (*encode)(const std::string& path, int width, int height, int channels,
                                       std::span<const float> pixels, PixelFormat format);
  /// The bytes of an OpenEXR texture in tiles, with all levels. @param levels  each half as large as the one before, rounded down
  std::vector<unsigned char> (*encodeTexture)(const std::string& path, std::span<const std::string> channels,
                                              std::span<const MipLevel> levels, PixelFormat format, bool periodic);
  bool (*isWritableName)(const std::string& path);
  /// The colours of the map "inferno" for values of 0..1. @param grey  [size][size] @return [size][size][3]
  std::vector<float> (*infernoColours)(int size, std::span<const float> grey);
};

/// Loads it on the first call.
/// @throws Error failed if the shared object is not where it was built or installed
const ImageFormats& imageFormats();

/// Reads a PNG without it.
/// @throws Error invalid_input if the file is damaged or truncated
StoredImage readPng(const std::string& path, std::uint64_t most_bytes);

/// Whether a file starts as every PNG does.
bool isPng(const std::string& path);

/// Refuses a header that declares more than its file can hold, or more than may be taken, before memory is taken for it.
/// @param format      as Image has it; files of some formats are as long as their pixels
/// @param most_bytes  memory that the pixels may take
/// @throws Error invalid_input; failed if it is the memory that does not suffice
void checkDeclaredSize(const std::string& path, const std::string& format, std::uint64_t pixel_bytes, std::uint64_t most_bytes);

/// Throws as the system's reason asks, if the last call of a library failed for one: too many open files, a disk that fails, no
/// memory. Set errno to 0 before the call. A library may give such a failure for damage.
/// @throws Error io, std::bad_alloc
void checkSystemReason(const std::string& path, int error);

/// The number of the part that is meant.
/// @param part   number or name; empty: the first
/// @param names  of all parts
/// @throws Error invalid_input if there is none
int findPart(const std::string& path, const std::string& part, const std::vector<std::string>& names);

/// "0 (beauty), 1 (normals)": numbers and names of the first images.
std::string partList(const std::vector<std::string>& names);

/// Reads a file to its end, so that errors of the system are not taken for damage of the file.
/// @throws Error io
void checkSystemReads(const std::string& path);

/// @throws Error invalid_input; io if it is the system that does not read the file
[[noreturn]] void throwDamagedImage(const std::string& path, const std::string& reason);

}  // namespace glint::apps
