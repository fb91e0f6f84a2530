#pragma once

#include <cstddef>
#include <cstdint>
#include <optional>
#include <span>
#include <string>
#include <variant>
#include <vector>

#include "glint/model/map_slopes.h"
#include "glint/model/normal_map.h"

namespace glint::bake {

/// Pixels as they came from a file, bottom row first: [height][width][channels].
struct PixelArray {
  int width = 0;
  int height = 0;
  int channels = 0;
  std::variant<std::span<const std::uint8_t>, std::span<const std::uint16_t>, std::span<const float>> pixels;
  double code_scale = 1;  ///< number in the file that a float of 1 stands for
  float step = 0;         ///< of floats that were computed from codes: difference of neighbouring codes; 0: unknown
};

/// Which way green points in the file.
enum class Convention : std::uint8_t { opengl, directx };

/// How a component n of a normal is stored as a pixel value.
enum class Encoding : std::uint8_t {
  automatic,  ///< integers: unorm; floats: the one that makes the vectors nearer to unit length
  unorm,      ///< (n + 1) / 2; an integer code c of b bits is c / (2^b - 1)
  snorm,      ///< n itself; an integer code c of b bits is (c - 2^(b-1)) / (2^(b-1) - 1), so that 128 of 8 bits is 0
};

/// What to do about the steps of integer codes, which put a comb into the normal distribution.
enum class Dequantize : std::uint8_t {
  automatic,  ///< tpdf for codes of 8 bits, also those that were scaled to 16 bits or floats; none for others
  none,
  tpdf,  ///< add triangular noise of +-1 code (none for floats that were not made from codes)
};

/// Channels that hold x and y, and z unless it follows from them.
enum class NormalChannels : std::uint8_t {
  rgb,  ///< x, y and z
  rg,   ///< x and y: there are only two, or blue is constant
  ag,   ///< x in alpha and y in green, as DXT5 keeps them (DXT5nm)
};

/// How pixels become normals or heights.
struct IngestOptions {
  std::string name;  ///< of the image, for error messages
  Convention convention = Convention::opengl;
  Encoding encoding = Encoding::automatic;
  Dequantize dequantize = Dequantize::automatic;
  bool fix_invalid = false;     ///< replace unusable texels by the mean of their usable neighbours instead of failing
  bool trust_channels = false;  ///< the channels are x, y (and z) whatever they look like
  /// Number that texels without data hold, as it is in the file. They are replaced as by fix_invalid, and counted.
  std::optional<double> no_data;
  bool refuse_sentinels = true;        ///< without no_data: refuse heights that seem to hold such a number
  Boundary boundary = Boundary::wrap;  ///< of slopes of heights, and of the neighbours of texels that are replaced
  bool allow_constant = false;         ///< accept a map of a single value
  float height_scale = 1;              ///< height in texels of a pixel value of 1 (the largest code of an integer)
  std::uint64_t seed = 1;              ///< of the noise
};

/// What a map was found to be. Moments are of the result.
struct IngestReport {
  Encoding encoding = Encoding::unorm;
  bool dequantized = false;
  std::size_t texels = 0;
  std::size_t non_finite = 0;  ///< NaN or infinite pixels
  std::size_t downward = 0;    ///< z <= 0 by more than rounding, or x^2 + y^2 > 1 without z
  std::size_t clipped = 0;     ///< z <= 0 or x^2 + y^2 > 1 by rounding only: moved to just inside the disk
  std::size_t non_unit = 0;    ///< length differs from 1 by more than rounding explains; normalised
  std::size_t no_data = 0;     ///< texels that hold the number for no data
  std::size_t repaired = 0;    ///< texels that were replaced by their neighbours' mean
  std::size_t cliffs = 0;      ///< normals of heights that are steeper than 89.9 degrees: moved there
  NormalChannels channels = NormalChannels::rgb;
  bool blue_ignored = false;       ///< there is a blue channel, but it is constant and contradicts x and y
  bool coarse_codes = false;       ///< the pixels are codes of 8 bits at most, whatever they are stored in
  double median_length_error = 0;  ///< of vectors (x, y, z): half of them are farther from unit length
  Vec2 seam;                       ///< of heights: seamRoughness
  Vec2 mean_normal;                ///< mean of (nx, ny)
  double mean_tilt_deg = 0;        ///< mean angle between normal and z
  MapSlopes slopes;
  float steepest_tilt_deg = 0;
};

struct IngestedNormals {
  std::vector<Vec2> normals;  ///< [height][width]
  IngestReport report;
};

struct IngestedHeights {
  std::vector<float> heights;  ///< [height][width], texels
  IngestReport report;         ///< moments are of the normals of these heights
};

/// Normals of a normal map. x, y (and z) are the first channels; a map of two has z reconstructed. (x, y, z) is normalised.
/// Where blue is constant and contradicts x and y, z follows from them; where red is constant at an end, x is in alpha.
/// At most one texel in 1000 may point below the surface: such texels are replaced as by fix_invalid, and counted.
/// @throws Error invalid_input, naming the first texel at fault (texelName): one channel, a constant map, values that were
///         converted to or from sRGB, vectors far from unit length (a photograph), blue or alpha that hold something else,
///         texels that are not finite, more texels that point below the surface (unless fix_invalid)
IngestedNormals ingestNormals(const PixelArray& image, const IngestOptions& options);

/// Heights of a height field: the first channel times height_scale.
/// @throws Error invalid_input: channels that differ, a constant map, texels that are not finite (unless fix_invalid), numbers
///         that seem to stand for no data (refuse_sentinels)
IngestedHeights ingestHeights(const PixelArray& image, const IngestOptions& options);

/// Moments and counts of a map of normals: everything of the report that does not need the pixels.
IngestReport describeNormals(int width, int height, std::span<const Vec2> normals);

}  // namespace glint::bake
