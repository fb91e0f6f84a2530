#pragma once

#include <cstddef>
#include <cstdint>
#include <memory_resource>
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
  double code_scale = 1;    ///< number in the file that became a float of 1
  bool inverted = false;    ///< the file held code_scale minus the code: 0 is white in it
  float step = 0;           ///< difference of neighbouring codes, if floats were computed from integer codes; 0: unknown
  bool grey_alpha = false;  ///< the two channels are grey and alpha, and not red and green
};

/// Direction of +y in the file: up (opengl) or down (directx).
enum class Convention : std::uint8_t { opengl, directx };

/// How a component n of a normal is stored as a pixel value.
enum class Encoding : std::uint8_t {
  automatic,  ///< integers: unorm; floats: the encoding with which vectors are nearer to unit length
  unorm,      ///< (n + 1) / 2; an integer code c of b bits is c / (2^b - 1)
  snorm,      ///< n itself; an integer code c of b bits is (c - 2^(b-1)) / (2^(b-1) - 1), so that 128 of 8 bits is 0
};

/// How to hide the steps of integer codes. Undisturbed, they make the normal distribution a comb of peaks.
enum class Dequantize : std::uint8_t {
  automatic,  ///< tpdf for codes of 8 bits, even if they were scaled to 16 bits or floats; none for other codes
  none,
  tpdf,  ///< triangular noise of +-1 code (none for floats that were not made from codes)
};

/// Channels that have x and y, and z unless z is computed from x and y.
enum class NormalChannels : std::uint8_t {
  rgb,  ///< x, y and z
  rg,   ///< x and y: there are only two channels, or blue is constant
  ag,   ///< x in alpha and y in green, as in DXT5 normal maps (DXT5nm)
};

/// How pixels become normals or heights.
struct IngestOptions {
  std::string name;  ///< name of the image, for error messages
  Convention convention = Convention::opengl;
  Encoding encoding = Encoding::automatic;
  Dequantize dequantize = Dequantize::automatic;
  bool fix_invalid = false;     ///< replace unusable texels by the mean of their usable neighbours instead of failing
  bool trust_channels = false;  ///< the first channels are x, y (and z): skips the checks for other contents
  /// Number, as it is in the file, that marks texels without data. These texels are replaced as by fix_invalid, and counted.
  std::optional<double> no_data;
  bool refuse_sentinels = true;  ///< without no_data: refuse heights among which a number seems to mark texels without data
  Boundary boundary = Boundary::wrap;  ///< for slopes of heights, and for neighbours of texels that are replaced
  bool allow_constant = false;         ///< accept a map of a single value
  float height_scale = 1;              ///< height, in texels, of a pixel value of 1 (the largest code of an integer)
  std::uint64_t seed = 1;              ///< seed of the noise
};

/// Properties of a map, as it was read, and moments of the resulting normals.
struct IngestReport {
  Encoding encoding = Encoding::unorm;
  bool dequantized = false;
  std::size_t texels = 0;
  std::size_t non_finite = 0;  ///< NaN or infinite pixels
  std::size_t downward = 0;    ///< z <= 0 by more than rounding, or x^2 + y^2 > 1 without z
  std::size_t clipped = 0;     ///< z <= 0 or x^2 + y^2 > 1 by rounding alone: moved to just inside the disk
  std::size_t non_unit = 0;    ///< length differs from 1 by more than rounding explains; normalised
  std::size_t no_data = 0;     ///< texels with the number that marks no data
  std::size_t repaired = 0;    ///< texels that were replaced by the mean of their neighbours
  std::size_t cliffs = 0;      ///< normals of heights that are steeper than 89.9 degrees: moved to 89.9 degrees
  NormalChannels channels = NormalChannels::rgb;
  bool blue_ignored = false;   ///< whether there is a blue channel that contradicts x and y: it is constant, or positive_blue
  bool positive_blue = false;  ///< whether blue holds z from 0 to 1 rather than from -1 to 1; z was taken from x and y
  bool coarse_codes = false;   ///< whether pixels are codes of at most 8 bits, whatever type stores them
  double median_length_error = 0;  ///< median of |length - 1| of the vectors (x, y, z)
  Vec2 seam;                       ///< seamRoughness of heights
  Vec2 mean_normal;                ///< mean of (nx, ny)
  double mean_tilt_deg = 0;        ///< mean angle between normal and z
  MapSlopes slopes;
  float steepest_tilt_deg = 0;
};

/// Arrays are in memory of the default resource (std::pmr::get_default_resource), so that a program can say where.
struct IngestedNormals {
  std::pmr::vector<Vec2> normals;  ///< [height][width]
  IngestReport report;
};

struct IngestedHeights {
  std::pmr::vector<float> heights;  ///< [height][width], texels
  IngestReport report;              ///< with moments of the normals of these heights
};

/// Reads the normals of a normal map. The first channels are x, y and z, and (x, y, z) is normalised. With two channels, z is
/// computed from x and y; also if blue is constant and contradicts x and y. If red is constant at 0 or 1, x is in alpha.
/// At most one texel in 1000 may point below the surface: such texels are replaced as by fix_invalid, and counted.
/// @throws Error invalid_input, naming the first texel at fault (texelName): one channel; a constant map; values that were
///         converted to or from sRGB; vectors far from unit length (a photograph); blue or alpha with other contents; unless
///         fix_invalid, texels that are not finite, or more than 1 in 1000 that point below the surface
IngestedNormals ingestNormals(const PixelArray& image, const IngestOptions& options);

/// Reads the heights of a height field: the first channel times height_scale.
/// @throws Error invalid_input: colour channels that differ; a constant map; texels that are not finite (unless fix_invalid); a
///         number that seems to mark texels without data (refuse_sentinels)
IngestedHeights ingestHeights(const PixelArray& image, const IngestOptions& options);

/// Fills the parts of a report that normals alone give: moments and counts.
IngestReport describeNormals(int width, int height, std::span<const Vec2> normals);

}  // namespace glint::bake
