#pragma once

#include <cstdint>
#include <vector>

#include "glint/bake/pyramid/pyramid.h"
#include "glint/math/vec.h"

namespace glint::bake {

/// A dense NDF image that is summed from lobes of facets.
class TileImage {
 public:
  /// @param resolution  pixels along each axis
  TileImage(int resolution, float sigma);

  /// Adds the mass of a lobe to the pixels around its normal.
  void add(Vec2 normal, double weight);
  /// Adds an image, divided by its own weight.
  void addImage(const TileImage& image, double weight);
  /// Pixels around a normal that add() changes, about.
  double pixelsOfLobe() const;
  /// Mass of each pixel, [resolution][resolution].
  const std::vector<double>& masses() const { return masses_; }
  double total() const { return total_; }
  void clear();

 private:
  int resolution_;
  float sigma_;
  double total_ = 0;  ///< weight that was added
  std::vector<double> masses_;
};

/// The blocks of an image that have more than kBlockMassThreshold of the mass.
struct StoredImage {
  std::vector<std::uint64_t> mask;
  std::vector<float> means;
  std::vector<std::uint16_t> half_pixels;
  std::vector<float> float_pixels;
};

/// Divides an image by the weight that was added, and keeps its occupied blocks.
StoredImage storeImage(const TileImage& image, const PyramidShape& shape, BlockPrecision precision, float value_scale);

/// Joins the images of a level.
NdfPyramidData::Level joinImages(const std::vector<StoredImage>& images);

}  // namespace glint::bake
