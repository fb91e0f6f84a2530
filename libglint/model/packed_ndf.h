#pragma once

#include <cstddef>
#include <cstdint>

#include "glint/model/ndf_cp.h"
#include "glint/model/ndf_pyramid.h"
#include "glint/model/normal_map.h"

namespace glint {

// One linear buffer with all data that the queries of one model read, so that one copy brings a model to a GPU or to another
// process. The buffer has no addresses, only offsets from its first byte: a copy works at any address aligned to 16 bytes.
//
//   0                      PackedHeader, 1920 bytes
//   1920                   the arrays of the model, each at a multiple of 64 bytes, in the order of the header
//   header.size_bytes      end
//
// glint::api::pack writes a buffer, and PackedNdfView (glint/query/packed_ndf_view.h) makes models from it. All numbers are
// little-endian. A buffer is made from an asset in memory and is no file format: its version changes with every layout.

/// An array of a packed buffer. An array that the model does not have has count 0.
struct PackedArray {
  std::uint64_t offset;  ///< bytes from the start of the buffer; a multiple of 64
  std::uint64_t count;   ///< elements
};
static_assert(sizeof(PackedArray) == 16);

/// PyramidGrid, and the index of the level's first image (kind compressed).
struct PackedGrid {
  float stride;
  std::int32_t columns;
  std::int32_t rows;
  std::uint32_t first_image;
};
static_assert(sizeof(PackedGrid) == 16);

/// `unknown` is never written. It is the kind of a buffer of another version.
enum class PackedKind : std::uint32_t { normals = 0, pyramid = 1, compressed = 2, unknown = 0xffffffff };

inline constexpr std::uint32_t kPackedMagic = 0x6e6c6721;  // "!gln"
inline constexpr std::uint32_t kPackedVersion = 6;
inline constexpr std::size_t kPackedAlignment = 64;
/// Numbers of arrays of a level of a pyramid, and of a compressed pyramid. PackedHeader::arrays has room for either.
inline constexpr int kPackedArrays = 4 * kMaxPyramidLevels;

/// The first bytes of a packed buffer.
struct PackedHeader {
  std::uint32_t magic;                                       //   0
  std::uint32_t version;                                     //   4
  std::uint64_t size_bytes;                                  //   8  of the whole buffer
  PackedKind kind;                                           //  16
  std::int32_t width;                                        //  20  of the normal map, texels
  std::int32_t height;                                       //  24
  std::int32_t resolution;                                   //  28  pixels of an NDF image; 0 for normals
  float sigma_r;                                             //  32
  std::uint32_t surface;                                     //  36
  std::uint32_t boundary;                                    //  40
  std::int32_t level_count;                                  //  44
  std::uint32_t element_type;                                //  48  pyramid: BlockPrecision; compressed: CoefficientType
  std::uint32_t method;                                      //  52  compressed: CompressionMethod
  float value_scale;                                         //  56  pyramid
  std::int32_t regions;                                      //  60  compressed
  std::int32_t places;                                       //  64
  float overlap;                                             //  68  0 for normals
  std::int32_t bounds_level_count;                           //  72  of the normals
  float texel_size_um;                                       //  76
  PackedGrid levels[kMaxPyramidLevels];                      //   80
  std::int32_t bounds_columns[NormalMap::kMaxBoundsLevels];  //  336
  std::int32_t bounds_rows[NormalMap::kMaxBoundsLevels];     //  416
  PackedArray normals;                              //  496  kind normals, or for footprints below level 0; see near_type
  PackedArray bounds[NormalMap::kMaxBoundsLevels];  //  512  see near_type
  float slope_mean[2];                              //  832  of the map's texels, as MapSlopes
  float slope_covariance[3];                        //  840  xx, xy, yy
  std::uint32_t near_type;                          //  852  NearType of normals and bounds; kind normals: f32
  float near_step;                                  //  856  NearNormals::step
  std::uint32_t reserved[9];                        //  860  0
  /// 896. Pyramid: masks, mask_ranks, block_means and pixels of level l at 4 l. Compressed: image_regions, image_slots,
  /// image_scales, clusters, masks, mask_ranks, basis, coefficients, scales, density_scales,
  /// block_masks, first_block, block_masses, block_places, place_blocks, core, spot_sums, floors.
  PackedArray arrays[kPackedArrays];
};
static_assert(offsetof(PackedHeader, size_bytes) == 8 && offsetof(PackedHeader, kind) == 16);
static_assert(offsetof(PackedHeader, sigma_r) == 32 && offsetof(PackedHeader, element_type) == 48);
static_assert(offsetof(PackedHeader, places) == 64 && offsetof(PackedHeader, levels) == 80);
static_assert(offsetof(PackedHeader, bounds_columns) == 336 && offsetof(PackedHeader, bounds_rows) == 416);
static_assert(offsetof(PackedHeader, normals) == 496 && offsetof(PackedHeader, bounds) == 512);
static_assert(offsetof(PackedHeader, slope_mean) == 832 && offsetof(PackedHeader, arrays) == 896);
static_assert(sizeof(PackedHeader) == 1920 && sizeof(PackedHeader) % kPackedAlignment == 0);

/// Bytes of an element of the arrays that have no type of their own.
GLINT_HD constexpr std::size_t pixelBytes(BlockPrecision precision) { return precision == BlockPrecision::f16 ? 2 : 4; }
GLINT_HD constexpr std::size_t coefficientBytes(CoefficientType type) {
  return type == CoefficientType::i8 ? 1 : type == CoefficientType::f16 ? 2 : 4;
}

}  // namespace glint
