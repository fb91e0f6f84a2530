#pragma once

#include <array>
#include <string>
#include <vector>

#include "glint/bake/ingest.h"

/// The parts of ingestNormals and ingestHeights that look for wrong inputs and repair them.
namespace glint::bake {

/// The texelName of a texel of the image.
std::string texelName(const PixelArray& image, std::size_t texel);

/// Throws unless the image has the pixels that it claims and at least `channels` channels.
void checkShape(const PixelArray& image, const std::string& name);

/// Throws if every pixel holds the same values in its first `channels` channels.
void checkNotConstant(const PixelArray& image, int channels, const std::string& name);

/// Pixel value of a channel as a float: floats as they are, integers as code / largest code.
float pixelValue(const PixelArray& image, std::size_t texel, int channel);

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

EncodingEvidence weighEncoding(const PixelArray& image, int channels);

/// Throws if the evidence says that the colours went through an sRGB conversion, or are no normals at all.
void checkEncoding(const EncodingEvidence& evidence, Encoding encoding, int channels, const std::string& name);

/// Replaces each texel that is not finite by the mean of its finite neighbours among the eight around it (wrapped), in passes
/// from the rim of a hole inwards.
/// @return number of texels replaced
/// @throws Error invalid_input if more than half of the map is not finite
std::size_t fillHoles(int width, int height, std::vector<Vec2>& values, const std::string& name);
std::size_t fillHoles(int width, int height, std::vector<float>& values, const std::string& name);

}  // namespace glint::bake
