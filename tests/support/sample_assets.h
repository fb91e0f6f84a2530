#pragma once

// Small but complete assets of every kind, computed by the shortest code that is right. Tests and golden files use them; the
// builders of glint::bake are not involved, so that the format can be tested on its own.

#include <cstdint>
#include <memory>
#include <ostream>
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
    std::vector<float> lobe_colors;
    std::vector<float> lobe_alphas;
    std::vector<MapSlopes> slopes;
    std::vector<float> fit_errors;
    std::vector<float> spatial_scale;
    std::vector<std::uint16_t> angular_scale;
    std::vector<float> spatial_terms;
    std::vector<std::uint16_t> angular_terms;
    std::vector<float> singular_shares;
  };
  std::vector<Level> levels;
  std::vector<float> base_table;
  Displacement displacement;
};

/// Normals that an asset keeps, and the memory behind them.
struct SampleNearNormals {
  std::vector<Vec2> normals;
  std::vector<NormalCode> codes;
  std::vector<std::vector<NormalBounds>> bounds;
  std::vector<std::vector<CodeBounds>> code_bounds;
  NearNormals near;
};

struct SamplePyramid {
  struct Level {
    std::vector<std::uint64_t> masks;
    std::vector<std::uint32_t> mask_ranks;
    std::vector<float> block_means;
    std::vector<std::uint16_t> halves;
    std::vector<float> floats;
  };
  std::vector<Level> levels;
  SampleNearNormals kept;
  NdfPyramid pyramid;
};

struct SamplePyramidShard {
  SamplePyramid whole;
  NdfPyramidShard shard;
};

struct SampleWavePyramid {
  SamplePyramid grey;
  std::vector<float> wavelengths_um;
  std::vector<Rgb> channel_rgb;
  std::vector<std::vector<std::uint16_t>> halves;  ///< of each level
  std::vector<std::vector<float>> floats;
  WavePyramid wave;
};

struct SampleNdfCp {
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
  std::vector<std::int32_t> basis;
  std::vector<std::int8_t> coefficients_i8;
  std::vector<std::uint16_t> coefficients_f16;
  std::vector<float> coefficients_f32;
  std::vector<float> scales;
  std::vector<std::uint8_t> core;
  std::vector<std::uint16_t> block_places;
  std::vector<std::uint16_t> place_blocks;
  std::vector<float> spot_sums;
  std::vector<std::uint8_t> floors;
  SampleNearNormals kept;
  NdfCp ndf;
};

/// How the slices of a sample with coefficients of i8 are stored.
enum class SampleForm : std::uint8_t {
  wide,    ///< 8 bits
  narrow,  ///< the last two columns with 4 bits
  spots,   ///< a spot and a rest
};

struct SampleBinMap {
  std::vector<std::uint32_t> nodes, texels, class_keys;
  std::vector<std::uint64_t> cell_bases;
  std::vector<std::uint16_t> block_moments, cell_offsets, texel_classes;
  BinMap map;
};

struct SampleHistograms {
  std::vector<std::uint16_t> bin_ids;
  std::vector<Vec2> bin_normals;
  std::vector<MapSlopes> bin_slopes;
  std::vector<std::uint64_t> bin_totals;
  std::vector<std::uint16_t> texels, sums, row_sums, column_sums;
  std::vector<std::uint32_t> coarse_sums;
  HistogramSat sat;
};

struct SampleSlopeMoments {
  std::vector<std::vector<MapSlopes>> texels;
  SlopeMoments moments;
};

struct SampleTinyExample {
  SamplePyramid images;
  std::vector<Vec2> normals;
  TinyExample example;
};

struct SampleWangTiles {
  std::vector<Vec2> normals;
  WangTiles tiles;
};

struct SampleWaveCp {
  SampleNdfCp images;
  std::vector<float> wavelengths_um;
  std::vector<Rgb> channel_rgb;
  WaveCp wave;
};

struct SampleWangPyramid {
  SamplePyramid images;
  std::vector<float> masses;
  WangPyramid asset;
};

struct SampleWangCp {
  SampleNdfCp images;
  std::vector<float> masses;
  WangCp asset;
};

struct SampleShLobes {
  std::vector<float> zonal;
  std::vector<float> coefficients;
  ShLobes lobes;
};

struct SampleShLight {
  std::vector<float> scales;
  std::vector<float> band_norms;
  std::vector<std::uint16_t> coefficients;
  ShLight light;
};

/// Bumps in the disk; sizes need not be powers of two.
SampleNormals sampleNormals(int width, int height, bool with_bounds = true);
SampleHeights sampleHeights(int width, int height);
/// Two levels (factors 4 and 8) over bumps, with lobes and scales from formulas; angular 3, two lobes.
/// @param colored  with three channels, colours and roughness of lobes
SampleDisplacement sampleDisplacement(int size, bool colored = false);
/// The same, grey, with a base that is a table: its values grow along every axis.
SampleDisplacement sampleDisplacedTable(int size);
/// NDF images of sampleNormals(size, size) at strides size/4, size/2 and size, 64^2 pixels, sigma_r 0.05.
SamplePyramid samplePyramid(int size, BlockPrecision precision);
/// The normals of sampleNormals(size, size), in 16 bits with a step of 2^-15 or as they are.
SampleNearNormals sampleNearNormals(int size, NearType type);
/// samplePyramid and sampleNdfCp that keep these normals.
SamplePyramid samplePyramidWithNormals(int size, NearType type);
SampleNdfCp sampleNdfCpWithNormals(int size, NearType type);
/// The first of two regions of samplePyramid, which has no image of the last level.
SamplePyramidShard samplePyramidShard(int size);
/// The same, of a pyramid that keeps normals in 16 bits.
SamplePyramidShard samplePyramidShardWithNormals(int size);
/// The same images, each block approximated by a constant and slopes; two regions.
SampleNdfCp sampleNdfCp(int size, CompressionMethod method, CoefficientType type, SampleForm form = SampleForm::wide);

/// sampleNormals(width, height) in 9 x 9 bins; lists of more than 64 texels have grids of 4 cells. Every second bin starts a
/// class.
SampleBinMap sampleBinMap(int width, int height);
/// Histograms of sampleNormals(width, height) over 12 x 8 bins; strides 4, 8 and 16 texels.
SampleHistograms sampleHistograms(int width, int height);
/// samplePyramid with channels: channel c is brighter than the mean by the same share at every pixel.
SampleWavePyramid sampleWavePyramid(int size, WaveChannels meaning, BlockPrecision precision);
/// sampleNdfCp with channels: channel c has the images of the sample, turned by 4 c pixels along x.
SampleWaveCp sampleWaveCp(int size, WaveChannels meaning);
/// Level 1 and up of a chain, whose slopes are simple fractions. Half the width and half the height, rounded down, are powers of two.
SampleSlopeMoments sampleSlopeMoments(int width, int height);
/// An example of the normals of sampleNormals. Its images have a pixel for each texel.
/// @param size  a power of two
SampleTinyExample sampleTinyExample(int size, TinyMode mode);
/// Sixteen tiles of 16 x 16 texels, two colours. Normals are the same in all tiles of the same colours on a side, and simple fractions.
SampleWangTiles sampleWangTiles(WangScheme scheme = WangScheme::corner);
/// Images of the tiles of sampleWangTiles, an even block each; compressed as sampleNdfCp.
SampleWangPyramid sampleWangPyramid();
SampleWangCp sampleWangCp();
/// A lobe of order 1 with the zonal coefficients 0.28 and 0.4, on a grid of 3 x 4 directions.
SampleShLobes sampleShLobes();
/// Constant light of radiance 1, 2 and 3 in red, green and blue, order 2, on a grid of 3 x 4 directions.
SampleShLight sampleShLight();

/// An asset of any kind and the memory behind it.
struct OwnedAsset {
  formats::AnyAsset asset;
  std::shared_ptr<const void> memory;
};

/// One of the samples below, made when it is asked for.
struct SampleAsset {
  const char* name;  ///< of its golden file, without the extension
  OwnedAsset (*make)();
};

/// How tests name a sample.
inline void PrintTo(const SampleAsset& sample, std::ostream* out) { *out << sample.name; }

/// Samples of all kinds, and of the ways in which a kind can be stored. A new kind is added here.
std::vector<SampleAsset> sampleAssets();

formats::Provenance sampleProvenance();

std::uint16_t floatToHalf(float value);
float halfToFloat(std::uint16_t bits);

/// Pixel (x, y) of an image, read as SPEC.md says.
float pyramidPixel(const NdfPyramid& pyramid, int level, int image, int x, int y);
float ndfCpPixel(const NdfCp& ndf, int image, int x, int y);
/// What is taken off the pixel before negative pixels count as 0.
float ndfCpFloor(const NdfCp& ndf, int image, int x, int y);

}  // namespace glint::test
