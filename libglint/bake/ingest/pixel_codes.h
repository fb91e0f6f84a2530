#pragma once

#include <optional>
#include <span>

#include "glint/bake/ingest/ingest.h"

namespace glint::bake {

/// The integer codes that pixel values were made from.
struct PixelCodes {
  float step = 0;       ///< difference of neighbouring codes, in pixel values; 0 when unknown (floats)
  bool coarse = false;  ///< whether codes have at most 8 bits, whatever type stores the pixels
};

/// Finds the codes of an image. If all values of these channels lie on at most 256 evenly spaced numbers, somebody scaled 8-bit
/// codes to 16 bits or to floating point, and these are the codes. Else integers are codes themselves, and floats have none.
/// Values that are not finite are left out.
///
/// 16 bits are tested for k, k << 7, k << 8 and 257 k; floats for k / 255. Two channels or more are components of vectors, and
/// tested also for 2 k / 255 - 1, k / 127 - 1, (k - 128) / 127, k / 128 - 1 and k / 256. An image with fewer than 8 different
/// codes (24 for steps that are powers of two) may lie on such numbers by chance, and passes no test.
/// O(texels); a test ends at the first value that fails it
PixelCodes findCodes(const PixelArray& image, std::span<const int> channels);

/// Tests whether pixels have the number that marks texels without data.
class NoDataTest {
 public:
  /// @param number  as it is in the file; none: no pixel passes the test
  NoDataTest(const PixelArray& image, std::optional<double> number);

  bool operator()(float value) const;

 private:
  bool used_ = false;
  double number_ = 0;
  double scale_ = 1;
};

/// Finds a number in channel 0 that seems to mark texels without data: the lowest or the highest number, if it is farther from
/// all other numbers than these are from each other, and if it is a usual marker such as -9999 or -3.4e38, or a hundred times
/// farther.
/// @param known  passes pixels that are known to have no data; they are left out
/// @return the number as it is in the file
std::optional<double> findSentinel(const PixelArray& image, const NoDataTest& known);

}  // namespace glint::bake
