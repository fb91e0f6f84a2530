#pragma once

#include <array>
#include <string>
#include <vector>

#include "glint/bake/ingest/ingest.h"

/// The parts of ingestNormals and ingestHeights that look for wrong inputs and repair them.
namespace glint::bake {

/// The texelName of a texel of the image.
std::string texelName(const PixelArray& image, std::size_t texel);

/// Throws unless the image has the pixels that it claims and at least `channels` channels.
void checkShape(const PixelArray& image, const std::string& name);

/// Throws if every pixel holds the same values in these channels.
void checkNotConstant(const PixelArray& image, const std::vector<int>& channels, const std::string& name);

/// Pixel value of a channel as a float: floats as they are, integers as code / largest code.
float pixelValue(const PixelArray& image, std::size_t texel, int channel);

/// Where a map keeps the components of its vectors.
struct NormalLayout {
  NormalChannels channels = NormalChannels::rgb;
  int x = 0, y = 1, z = 2;  ///< channels; z is -1 where it follows from x and y

  bool hasZ() const { return z >= 0; }
  std::vector<int> used() const { return hasZ() ? std::vector{x, y, z} : std::vector{x, y}; }
};

/// Finds the channels. Blue counts as z here even where it is constant: only its vectors tell (measureVectors).
/// @throws Error invalid_input if two channels are not enough to tell: red, green and blue are the same
NormalLayout findLayout(const PixelArray& image, const IngestOptions& options);

/// Whether a channel has the same value everywhere.
bool isConstant(const PixelArray& image, int channel);

/// Whether two channels are the same everywhere.
bool areSame(const PixelArray& image, int a, int b);

/// What a sample of the texels says about the encoding: each is the mean of |length - 1| of the vectors under one assumption.
struct EncodingEvidence {
  double unorm = 0;
  double snorm = 0;
  double srgb_undone = 0;  ///< unorm after undoing an sRGB encoding
  double srgb_redone = 0;  ///< unorm after undoing an sRGB decoding
  double mean_x = 0;       ///< of the components under unorm
  double mean_y = 0;
  bool negative = false;  ///< some pixel value is below 0, as no unorm value is
  double far_unorm = 0;   ///< fraction of vectors that point down or whose length is off by more than a quarter
  double far_snorm = 0;
};

/// Whether floating-point pixels are snorm rather than unorm.
bool looksSigned(const EncodingEvidence& evidence);

EncodingEvidence weighEncoding(const PixelArray& image, const NormalLayout& layout);

/// Throws if the evidence says that the colours went through an sRGB conversion, or are no normals at all.
void checkEncoding(const EncodingEvidence& evidence, Encoding encoding, bool three, const std::string& name);

/// How far a sample of vectors (x, y, z) is from unit length, and whether z goes with x and y.
struct VectorEvidence {
  double median_error = 0;  ///< of | length - 1 |
  double off = 0;           ///< fraction that is off by more than rounding explains
  double too_long = 0;      ///< fraction that is longer than 1 by more than rounding and .03; filtering makes shorter ones
  double correlation = 1;   ///< of z with sqrt(1 - x^2 - y^2)
  double spread = 0;        ///< standard deviation of sqrt(1 - x^2 - y^2)
  double distance = 0;      ///< root mean square of the difference between the two
};

/// @param rounding  largest error of a component
VectorEvidence measureVectors(const PixelArray& image, const NormalLayout& layout, Encoding encoding, double rounding);

/// Throws if the vectors are far from unit length, or blue is not z.
void checkVectors(const VectorEvidence& evidence, const std::string& name);

/// A float counts as unit length within this and the rounding of its components.
inline constexpr double kUnitTolerance = 0.01;

/// Replaces each texel that is not finite by the mean of its finite neighbours among the eight around it, in passes from the
/// rim of a hole inwards. O(texels)
/// @return number of texels replaced
/// @throws Error invalid_input if more than half of the map is not finite
std::size_t fillHoles(int width, int height, std::vector<Vec2>& values, Boundary boundary, const std::string& name);
std::size_t fillHoles(int width, int height, std::vector<float>& values, Boundary boundary, const std::string& name);

}  // namespace glint::bake
