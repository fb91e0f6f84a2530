#pragma once

#include <array>
#include <span>
#include <string>
#include <vector>

#include "glint/bake/ingest/ingest.h"

/// Private to ingestNormals and ingestHeights: finds wrong inputs and repairs them.
namespace glint::bake {

/// Name of a texel of the image, for error messages (see texelName).
std::string texelName(const PixelArray& image, std::size_t texel);

/// Throws unless the image has pixels, and as many as its width, height and channels say.
void checkShape(const PixelArray& image, const std::string& name);

/// Throws if all pixels have the same values in these channels.
void checkNotConstant(const PixelArray& image, const std::vector<int>& channels, const std::string& name);

/// Pixel value of a channel as a float: floats as they are, integers as code / largest code.
float pixelValue(const PixelArray& image, std::size_t texel, int channel);

/// The channels in which a map has the components of its vectors.
struct NormalLayout {
  NormalChannels channels = NormalChannels::rgb;
  int x = 0, y = 1, z = 2;  ///< numbers of channels; z is -1 if z is computed from x and y

  bool hasZ() const { return z >= 0; }
  std::vector<int> used() const { return hasZ() ? std::vector{x, y, z} : std::vector{x, y}; }
};

/// Finds the channels of x, y and z. A constant blue channel still counts as z here: only the vectors tell whether it is
/// (measureVectors).
/// @throws Error invalid_input if red, green and blue are the same, also as grey and alpha of two channels, or if blue may be z or
///         something else
NormalLayout findLayout(const PixelArray& image, const IngestOptions& options);

/// Whether a channel has the same value in all pixels.
bool isConstant(const PixelArray& image, int channel);

/// Whether two channels have the same value in every pixel.
bool areSame(const PixelArray& image, int a, int b);

/// Evidence for the encoding of a map, from a sample of its texels. `unorm` to `srgb_redone` are means of |length - 1| over the
/// vectors, if pixels are decoded in one of four ways: the smallest shows the encoding.
struct EncodingEvidence {
  double unorm = 0;        ///< decoded as unorm
  double snorm = 0;        ///< decoded as snorm
  double srgb_undone = 0;  ///< converted from sRGB to linear, then decoded as unorm
  double srgb_redone = 0;  ///< converted from linear to sRGB, then decoded as unorm
  double mean_x = 0;       ///< mean of x, decoded as unorm
  double mean_y = 0;       ///< mean of y, decoded as unorm
  bool negative = false;   ///< whether a pixel value is below 0, as no unorm value is
  double far_unorm = 0;  ///< share of vectors, decoded as unorm, that point down or whose length is off by more than a quarter
  double far_snorm = 0;  ///< the same share, decoded as snorm
};

/// Whether floating-point pixels are snorm rather than unorm.
bool looksSigned(const EncodingEvidence& evidence);

/// Collects the evidence.
EncodingEvidence weighEncoding(const PixelArray& image, const NormalLayout& layout);

/// Throws if the evidence says that the pixels went through an sRGB conversion, or are no normals.
/// @param three  whether the map has z
void checkEncoding(const EncodingEvidence& evidence, Encoding encoding, bool three, const std::string& name);

/// Measures of a sample of vectors (x, y, z): their distance from unit length, and how z and w = sqrt(1 - x^2 - y^2) agree.
struct VectorEvidence {
  double median_error = 0;  ///< median of |length - 1|
  double off = 0;           ///< share of vectors whose length is off by more than rounding explains
  double too_long = 0;      ///< share of vectors that are longer than 1 by more than rounding and .03; filtering only shortens
  double correlation = 1;   ///< correlation of z and w
  double spread = 0;        ///< standard deviation of w
  double distance = 0;      ///< root mean square of z - w
  double stretch = 1;       ///< standard deviation of z over that of w
  double distance_if_positive = 0;  ///< root mean square of z - (2 w - 1): what blue is decoded to if it holds w itself
};

/// Measures the vectors of a map.
/// @param rounding  largest error of a component
VectorEvidence measureVectors(const PixelArray& image, const NormalLayout& layout, Encoding encoding, double rounding);

/// Whether blue holds z from 0 to 1, as some tools write it, rather than from -1 to 1.
/// @param rounding  largest error of a component
bool holdsPositiveZ(const VectorEvidence& evidence, double rounding);

/// Throws if the vectors are far from unit length, or if blue does not agree with red and green.
void checkVectors(const VectorEvidence& evidence, const std::string& name);

/// A vector counts as of unit length if its length is off by at most this and the rounding of its components.
inline constexpr double kUnitTolerance = 0.01;

/// Replaces each texel that is not finite by the mean of the finite texels among its eight neighbours, in passes from the rim
/// of a hole inwards. O(texels)
/// @return number of texels that were replaced
/// @throws Error invalid_input if more than half of the map is not finite
std::size_t fillHoles(int width, int height, std::span<Vec2> values, Boundary boundary, const std::string& name);
std::size_t fillHoles(int width, int height, std::span<float> values, Boundary boundary, const std::string& name);

}  // namespace glint::bake
