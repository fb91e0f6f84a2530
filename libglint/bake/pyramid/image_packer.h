#pragma once

#include <cstdint>
#include <span>
#include <vector>

#include "glint/bake/pyramid/direction_bins.h"
#include "glint/bake/pyramid/pyramid.h"
#include "glint/model/ndf_pyramid.h"

namespace glint::bake {

/// The blocks of one image that are stored, before its level is packed.
struct PackedImage {
  std::vector<std::uint64_t> mask;
  std::vector<float> means;
  std::vector<std::uint16_t> half_pixels;
  std::vector<float> float_pixels;
};

/// Bins, and the filter that makes pixels of them.
struct Layer {
  DirectionBins* bins;
  const PixelFilter* filter;
};

/// Filters bins into pixels, and keeps the blocks that have enough mass.
class ImagePacker {
 public:
  /// @param shape  must outlive the packer
  ImagePacker(const PyramidShape& shape, BlockPrecision precision, float value_scale);

  /// Makes one image.
  /// @param layers        bins; the pixels of all layers are added
  /// @param inverse_mass  1 over the mass of all bins
  PackedImage pack(std::span<const Layer> layers, float inverse_mass) const;

 private:
  void store(const float* pixels, float inverse_mass, PackedImage& image) const;

  const PyramidShape& shape_;
  BlockPrecision precision_;
  float to_stored_;
  float value_scale_;
};

/// Joins the images of a level, and frees them.
NdfPyramidData::Level packLevel(std::vector<PackedImage>& images, BlockPrecision precision);

/// The filter that makes pixels of the bins of flat surfaces.
PixelFilter flatFilter(const PyramidOptions& options);

/// What the pixels of images of this resolution are divided by: the largest pixel mean, (resolution / 2)^2, must be a half.
float valueScaleFor(int resolution);

}  // namespace glint::bake
