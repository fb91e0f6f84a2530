#pragma once

#include <cstddef>
#include <cstdint>
#include <span>
#include <string>
#include <variant>
#include <vector>

namespace glint::apps {

/// An image as its file holds it, but bottom row first.
struct Image {
  int width = 0;
  int height = 0;
  int channels = 0;
  std::vector<std::string> channel_names;
  std::string format;  ///< of the file, as OpenImageIO names it: "png", "openexr", ...
  int bits = 0;        ///< bits of a channel in the file: 1 to 16 (integers), 16 or 32 (floating point)
  bool floating = false;
  /// [height][width][channels]. Unsigned integers of up to 8 and 16 bits keep their codes (full range 255 and 65535);
  /// everything else becomes float (integers of more bits scaled to 0..1).
  std::variant<std::vector<std::uint8_t>, std::vector<std::uint16_t>, std::vector<float>> pixels;
};

/// Reads the first image of a file: PNG by libpng, every other format by OpenImageIO. Alpha is not multiplied into the other
/// channels.
/// @throws Error io if the file cannot be opened; invalid_input if it is no image, damaged or truncated
Image readImage(const std::string& path);

/// The first `channels` channels of every pixel; codes of integers become 0..1.
/// @param channels  at most those of the image
std::vector<float> channelsOf(const Image& image, int channels);

/// Linear value of an sRGB code in 0..1 (IEC 61966-2-1).
float linearFromSrgb(float code);

/// How pixels are stored. Formats that cannot hold the type are an error, not a conversion.
enum class PixelFormat : std::uint8_t { u8, u16, f16, f32 };

/// Writes an image whose format follows from the extension, atomically. Same bytes every time.
/// @param pixels  [height][width][channels], bottom row first. Integer formats: 0..1, rounded to the nearest code
/// @throws Error usage if a value is outside 0..1 for an integer format, or the extension is unknown; io if it cannot be
/// written
void writeImage(const std::string& path, int width, int height, int channels, std::span<const float> pixels,
                PixelFormat format);

/// Whether some image format has this file name extension and can be written.
bool isWritableImageName(const std::string& path);

}  // namespace glint::apps
