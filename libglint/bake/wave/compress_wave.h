#pragma once

#include <vector>

#include "glint/bake/compressed/compress.h"
#include "glint/model/wave_cp.h"

namespace glint::bake {

/// A WaveCp that owns its arrays.
class WaveCpData {
 public:
  WaveCp shape;  ///< without arrays, and without `images`
  std::vector<float> wavelengths_um;
  std::vector<Rgb> channel_rgb;
  NdfCpData images;

  /// Spans over the arrays; valid while this object lives and is not changed.
  WaveCp view() const;
};

/// Compresses the images of all channels of a wave pyramid together.
///
/// The images of a channel lie above those of the channel before, as rows of one pyramid, which compressPyramid compresses. So the
/// slices of all channels in one angular block share their bases. Errors are those of all channels together: a place and a
/// channel count as two places, and a channel is seen beside the brightest one towards the same psi.
///
/// Images of channels integrate to 1 afterwards. Where light leaves the square of psi, the pyramid has less; this counts as an error.
/// @param options  `image_masses` must be empty; `regions` of 0 is one region as far as its images can be counted, and more regions
///                 have bases for fewer channels; the rest as for compressPyramid
/// @param report   filled when not null; `ratio_to_stored` is that of the whole wave pyramid, with its grey pixels
/// @throws Error   as compressPyramid
/// @note memory: a copy of the pixels of the channels, and that of compressPyramid
WaveCpData compressWavePyramid(const WavePyramid& wave, const CompressionOptions& options, CompressionReport* report = nullptr,
                               const ProgressFn& progress = {});

/// Images of some channels as rows of one pyramid: row c rows + j of a level is row j of channel first + c. Blocks in which a channel
/// has no light are not stored.
class ChannelImages {
 public:
  /// @param wave  its arrays must outlive the construction
  ChannelImages(const WavePyramid& wave, int first, int count);

  /// Spans over the arrays; valid while this object lives.
  NdfPyramid view() const;

 private:
  struct Level {
    std::vector<std::uint64_t> masks;
    std::vector<std::uint32_t> mask_ranks;
    std::vector<float> block_means;
    std::vector<std::byte> pixels;
  };
  template <class Pixel>
  void addLevel(int level);

  WavePyramid wave_;
  int first_, count_;
  std::vector<Level> levels_;
};

}  // namespace glint::bake
