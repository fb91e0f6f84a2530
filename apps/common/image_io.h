#pragma once

#include <cstddef>
#include <cstdint>
#include <memory_resource>
#include <optional>
#include <span>
#include <string>
#include <variant>
#include <vector>

namespace glint::apps {

/// Pixels, in memory of the default resource: a tool that sets it to BoundedMemory (bounded_memory.h) reads images larger than memory.
template <class T>
using PixelVector = std::pmr::vector<T>;

/// An image as its file holds it, but bottom row first.
struct Image {
  int width = 0;
  int height = 0;
  int channels = 0;
  std::vector<std::string> channel_names;
  std::string format;  ///< of the file, as OpenImageIO names it: "png", "openexr", ...
  int bits = 0;        ///< bits of a channel in the file: 1 to 16 (integers), 16 or 32 (floating point)
  bool floating = false;
  double code_scale = 1;          ///< number in the file that a pixel value of 1 stands for: 1, or the largest code of integers
  bool inverted = false;          ///< 0 is white in the file: its codes are code_scale minus those of `pixels`
  int alpha = -1;                 ///< channel of alpha, if there is one
  bool associated = false;        ///< the other channels are multiplied by alpha
  std::optional<double> no_data;  ///< number in the file that pixels without data hold, if the file names one
  std::vector<std::string> parts;   ///< names of all images of the file, empty where they have none
  int part = 0;                     ///< the one that was read
  std::vector<std::string> layers;  ///< names of the layers of this part; channels without a layer have the empty name
  std::string layer;                ///< the one that was read
  std::vector<std::string> notes;   ///< what a reader of the file may not expect: clauses
  /// [height][width][channels]. Unsigned integers of up to 8 and 16 bits keep their codes (full range 255 and 65535);
  /// everything else becomes float (integers of more bits scaled to 0..1).
  std::variant<PixelVector<std::uint8_t>, PixelVector<std::uint16_t>, PixelVector<float>> pixels;
};

/// Which pixels of a file are meant, and what they mean.
struct ImageChoice {
  enum class Window : std::uint8_t { display, data };
  enum class Alpha : std::uint8_t { automatic, divide, ignore };

  std::string part = {};      ///< number (from 0) or name of one of several images; empty: the one with the layer, or the first
  std::string layer = {};     ///< the channels whose names start with this and a point; empty: the layer of the first channel
  std::string channels = {};  ///< letters such as "rg", or names with commas between them; empty: all of the layer
  Window window = Window::display;  ///< what the file shows, or what it stores
  Alpha alpha = Alpha::automatic;   ///< divide colours by alpha: if the file says that they were multiplied; always; never
  bool has_options = false;         ///< the tool has the options of ImageOptions, so that errors may point to them
  bool of_any_size = false;         ///< pixels may take more than the memory that is there (PixelVector)
  bool transparent_holes = false;   ///< colours that alpha 0 destroyed become NaN; otherwise they are an error
};

/// Reads an image as a viewer shows it: PNG by libpng, every other format by OpenImageIO. The orientation that the file names
/// is undone, the display window is cut out, and colours that are multiplied by alpha are divided by it, unless alpha itself
/// is one of the chosen channels.
/// @throws Error io if the file cannot be opened; invalid_input if it is no image, damaged or truncated, has pixels missing in
///         its display window, or lacks what is chosen
Image readImage(const std::string& path, const ImageChoice& choice = {});

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
