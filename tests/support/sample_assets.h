#pragma once

// Small but complete assets of every kind, computed by the shortest code that is right. Tests and golden files use them; the
// builders of glint::bake are not involved, so that the format can be tested on its own.

#include <cstdint>
#include <vector>

#include "glint/formats/asset_writer.h"

namespace glint::test {

/// A normal map with its bounds, and the memory behind it.
struct SampleNormals {
  std::vector<Vec2> normals;
  std::vector<std::vector<NormalBounds>> bounds;
  NormalMap map;
};

struct SampleHeights {
  std::vector<float> heights;
  HeightMap map;
};

struct SampleDisplacement {
  struct Level {
    std::vector<float> heights;
    std::vector<VmfLobe> lobes;
    std::vector<MapSlopes> slopes;
    std::vector<float> fit_errors;
    std::vector<float> spatial_scale;
    std::vector<std::uint16_t> angular_scale;
  };
  std::vector<Level> levels;
  Displacement displacement;
};

struct SamplePyramid {
  struct Level {
    std::vector<std::uint64_t> masks;
    std::vector<std::uint64_t> first_block;
    std::vector<float> block_means;
    std::vector<std::uint16_t> halves;
    std::vector<float> floats;
  };
  std::vector<Level> levels;
  NdfPyramid pyramid;
};

struct SampleCompressed {
  std::vector<std::uint16_t> image_regions;
  std::vector<std::uint16_t> image_slots;
  std::vector<float> image_scales;
  std::vector<float> density_scales;
  std::vector<std::uint64_t> block_masks;
  std::vector<std::uint32_t> first_block;
  std::vector<std::uint8_t> block_masses;
  std::vector<NdfCluster> clusters;
  std::vector<std::uint64_t> masks;
  std::vector<std::uint32_t> mask_ranks;
  std::vector<std::int16_t> basis_i16;
  std::vector<std::int32_t> basis_i32;
  std::vector<float> basis_f32;
  std::vector<std::int8_t> coefficients_i8;
  std::vector<std::uint16_t> coefficients_f16;
  std::vector<float> coefficients_f32;
  std::vector<float> scales;
  CompressedNdf ndf;
};

/// Bumps in the disk; sizes need not be powers of two.
SampleNormals sampleNormals(int width, int height, bool with_bounds = true);
SampleHeights sampleHeights(int width, int height);
/// NDF images of sampleNormals(size, size) at strides size/4, size/2 and size, 64^2 pixels, sigma_r 0.05.
/// Two levels (factors 4 and 8) over bumps, with lobes and scales from formulas; angular 3, two lobes.
SampleDisplacement sampleDisplacement(int size);
SamplePyramid samplePyramid(int size, BlockPrecision precision);
/// The same images, each block approximated by a constant and slopes; two regions.
SampleCompressed sampleCompressed(int size, CompressionMethod method, CoefficientType type);

formats::Provenance sampleProvenance();

std::uint16_t floatToHalf(float value);
float halfToFloat(std::uint16_t bits);

/// Pixel (x, y) of an image, read as SPEC.md says.
float pyramidPixel(const NdfPyramid& pyramid, int level, int image, int x, int y);
float compressedPixel(const CompressedNdf& ndf, int image, int x, int y);

}  // namespace glint::test
