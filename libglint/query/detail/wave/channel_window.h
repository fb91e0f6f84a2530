#pragma once

#include <algorithm>
#include <cstddef>
#include <cstdint>

#include "glint/math/bits.h"
#include "glint/math/float4.h"
#include "glint/model/wave_pyramid.h"
#include "glint/query/detail/pyramid/block_rows.h"
#include "glint/query/detail/pyramid/pixel_spline.h"
#include "glint/query/detail/pyramid/pyramid_slices.h"

namespace glint {

/// Reads a pixel and its eight neighbours, in some channels, from the images that answer a footprint.
class ChannelReader {
 public:
  /// Most channels that are read at once.
  static constexpr int kMost = 4;

  GLINT_HD ChannelReader(const WavePyramid& wave, const PyramidSlices& chosen) : wave_(wave), chosen_(chosen) {}

  /// Densities around a pixel, >= 0 or not finite where a file has such numbers.
  /// @param first    number of the first channel
  /// @param count    channels, 1 to kMost
  /// @param windows  receives one window for each channel
  GLINT_HD void read(const PixelPlace& place, int first, int count, PixelWindow (&windows)[kMost]) const {
    forEachBlockOfWindow(wave_.grey.shape, place, [&](int block, int x, int y) {
      wave_.grey.precision == BlockPrecision::f16 ? addBlock<std::uint16_t>(block, x, y, first, count, windows)
                                                  : addBlock<float>(block, x, y, first, count, windows);
    });
    for (int c = 0; c < count; ++c) windows[c] *= wave_.grey.value_scale;
  }

 private:
  /// The first rows that are read of the chosen images that store a block.
  template <class Pixel>
  struct Rows {
    const Pixel* first[PyramidSlices::kMost];
    float weights[PyramidSlices::kMost];
    int count = 0;
  };

  /// Pixels from a row of a block to the same row of the next channel, and to the next row.
  GLINT_HD std::ptrdiff_t rowPitch() const { return static_cast<std::ptrdiff_t>(kBlockSize) * wave_.channels; }

  /// Finds a block in every slice and prefetches the rows [low, high) of some channels. Has no branch on whether blocks are
  /// stored, which processors cannot predict.
  template <class Pixel>
  GLINT_HD void find(int block, int first_channel, int low, int high, Rows<Pixel>& rows) const {
    const auto words = static_cast<std::size_t>(wave_.grey.shape.maskWords());
    const unsigned word = static_cast<unsigned>(block) / 64, bit = static_cast<unsigned>(block) % 64;
    const auto pitch = static_cast<std::uint64_t>(rowPitch());
    for (int k = 0; k < chosen_.count; ++k) {
      const PyramidLevel& level = wave_.grey.levels[chosen_.level(k)];
      const std::size_t at = std::size_t{chosen_.images[k]} * words + word;
      const BitRank rank(level.masks.data()[at], bit);
      const std::uint64_t stored = std::uint64_t{level.mask_ranks.data()[at]} + rank.below;
      const std::uint64_t offset = ((stored * kBlockSize + static_cast<std::uint64_t>(low)) * pitch +
                                    static_cast<std::uint64_t>(first_channel) * kBlockSize) &
                                   rank.kept;
      const Pixel* pixels = static_cast<const Pixel*>(wave_.pixels[chosen_.level(k)]) + offset;
      rows.first[rows.count] = pixels;
      rows.weights[rows.count] = chosen_.weights[k];
      const bool used = (rank.kept & 1) != 0 && chosen_.weights[k] > 0;
      if (used)
        for (int row = low; row < high; ++row) prefetch(pixels + (row - low) * rowPitch());
      rows.count += used ? 1 : 0;
    }
  }

  /// Adds the part of a window that lies in a block.
  /// @param x, y  column and row of the window's first pixel in the block, -2 to 15
  template <class Pixel>
  GLINT_HD void addBlock(int block, int x, int y, int first, int count, PixelWindow (&windows)[kMost]) const {
    const int low = std::max(y, 0), high = std::min(y + PixelWindow::kSize, int{kBlockSize});
    Rows<Pixel> rows;
    find(block, first, low, high, rows);
    for (int row = low; row < high; ++row) {
      switch (count) {
        case 1:
          addRow<1>(rows, row - low, row - y, x, windows);
          break;
        case 2:
          addRow<2>(rows, row - low, row - y, x, windows);
          break;
        case 3:
          addRow<3>(rows, row - low, row - y, x, windows);
          break;
        default:
          addRow<4>(rows, row - low, row - y, x, windows);
      }
    }
  }

  /// Adds one row of a block, of kCount channels: four pixels at once, of which up to three are in the window.
  template <int kCount, class Pixel>
  GLINT_HD void addRow(const Rows<Pixel>& rows, int from, int to, int x, PixelWindow (&windows)[kMost]) const {
    constexpr int kLanes = 4;
    const int first = std::clamp(x, 0, kBlockSize - kLanes);
    const std::ptrdiff_t offset = from * rowPitch() + first;
    Float4 sums[static_cast<std::size_t>(kCount)];
    for (Float4& sum : sums) sum = Float4::zero();
    for (int k = 0; k < rows.count; ++k) {
      const Pixel* pixels = rows.first[k] + offset;
      const Float4 weight = Float4::all(rows.weights[k]);
      for (int c = 0; c < kCount; ++c) sums[c] = sums[c] + weight * loadPixels(pixels + c * kBlockSize);
    }
    for (int c = 0; c < kCount; ++c) {
      float lanes[kLanes];
      sums[c].store(lanes);
      for (int column = std::max(x, 0); column < std::min(x + PixelWindow::kSize, int{kBlockSize}); ++column)
        windows[c].pixels[to][column - x] += lanes[column - first];
    }
  }

  const WavePyramid& wave_;
  const PyramidSlices& chosen_;
};

}  // namespace glint
