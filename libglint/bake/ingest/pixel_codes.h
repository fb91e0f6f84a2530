#pragma once

#include <optional>
#include <span>

#include "glint/bake/ingest/ingest.h"

namespace glint::bake {

/// The integer codes that pixel values were made from.
struct PixelCodes {
  float step = 0;       ///< difference of neighbouring codes, in pixel values; 0 when unknown (floats)
  bool coarse = false;  ///< no more than 8 bits, whatever the pixels have
};

/// Finds the codes of an image: those of its integers, or, where all values of these channels lie on at most 256 evenly spaced
/// ones, the 8-bit codes that somebody scaled to 16 bits or to floating point. Values that are not finite are left out.
///
/// Looked for: k, k << 7, k << 8 and 257 k in 16 bits; k / 255 in floats, and where there are two channels or more, which are
/// components of vectors, 2 k / 255 - 1, k / 127 - 1, (k - 128) / 127, k / 128 - 1 and k / 256. An image with fewer than 8
/// different codes (24 for powers of two) shows nothing.
/// O(texels), but ends at the first value that is no such code
PixelCodes findCodes(const PixelArray& image, std::span<const int> channels);

/// Whether pixels hold the number that stands for no data.
class NoDataTest {
 public:
  /// @param number  as it is in the file; none: no pixel holds it
  NoDataTest(const PixelArray& image, std::optional<double> number);

  bool operator()(float value) const;

 private:
  bool used_ = false;
  double number_ = 0;
  double scale_ = 1;
};

/// The lowest or highest number of channel 0, as it is in the file, if it seems to stand for no data: it is farther from all
/// others than these are from each other, and is a usual one such as -9999 or -3.4e38, or a hundred times farther.
/// @param known  pixels that are known to stand for no data, and are left out
std::optional<double> findSentinel(const PixelArray& image, const NoDataTest& known);

}  // namespace glint::bake
