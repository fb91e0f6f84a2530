#pragma once

#include "glint/model/packed_ndf.h"
#include "glint/query/cp_ndf.h"
#include "glint/query/pyramid_ndf.h"
#include "glint/query/reference.h"

namespace glint {

/// Makes the models of a packed buffer. Checks only magic and version, so the header must come from glint::api::pack. A host
/// that has the whole buffer should use glint::api::viewPacked instead, which checks it and reports errors.
///
/// Header and arrays are two arguments, because one processor may make the model and another ask it: a host then reads its own
/// copy of the header, and passes the address of the buffer on the device. On the device both are the address of the buffer.
/// @see glint/model/packed_ndf.h for the layout
class PackedNdfView {
 public:
  /// @param header  first bytes of the buffer, readable here
  /// @param base    address of the buffer for the processor that asks the model; aligned to 16 bytes
  GLINT_HD PackedNdfView(const PackedHeader& header, const void* base)
      : header_(header), base_(static_cast<const unsigned char*>(base)) {}
  PackedNdfView(const PackedHeader&& header, const void* base) = delete;
  GLINT_HD explicit PackedNdfView(const void* buffer) : PackedNdfView(*static_cast<const PackedHeader*>(buffer), buffer) {}

  /// Whether pack() of this version wrote the header. If not, kind() is unknown and no model may be made.
  GLINT_HD bool known() const { return header_.magic == kPackedMagic && header_.version == kPackedVersion; }
  GLINT_HD PackedKind kind() const { return known() ? header_.kind : PackedKind::unknown; }
  GLINT_HD bool hasNormals() const { return known() && header_.normals.count > 0; }

  /// Kind normals.
  GLINT_HD Reference reference() const {
    return Reference(normalMap(), header_.sigma_r, static_cast<Surface>(header_.surface),
                     static_cast<Boundary>(header_.boundary), Reference::Search::pruned);
  }
  /// Kind pyramid, with its normals if they were packed.
  GLINT_HD PyramidNdf pyramidNdf(Interpolation interpolation = Interpolation::footprint, Pixels pixels = Pixels::smooth) const {
    return hasNormals() ? PyramidNdf(pyramid(), nearNormals(), interpolation, pixels)
                        : PyramidNdf(pyramid(), interpolation, pixels);
  }
  /// Kind compressed, with its normals if they were packed.
  GLINT_HD CpNdf cpNdf(Interpolation interpolation = Interpolation::footprint, Pixels pixels = Pixels::smooth) const {
    return hasNormals() ? CpNdf(ndfCp(), nearNormals(), interpolation, pixels) : CpNdf(ndfCp(), interpolation, pixels);
  }

  /// The normals for footprints below level 0.
  GLINT_HD NearNormals nearNormals() const {
    NearNormals near;
    near.width = header_.width;
    near.height = header_.height;
    near.type = static_cast<NearType>(header_.near_type);
    near.step = header_.near_step;
    near.texels = base_ + header_.normals.offset;
    near.bounds_level_count = header_.bounds_level_count;
    for (int k = 0; k < header_.bounds_level_count; ++k)
      near.bounds[k] = {header_.bounds_columns[k], header_.bounds_rows[k], base_ + header_.bounds[k].offset};
    return near;
  }

  /// Kind normals.
  GLINT_HD NormalMap normalMap() const {
    NormalMap map;
    map.width = header_.width;
    map.height = header_.height;
    map.texel_size_um = header_.texel_size_um;
    map.normals = array<Vec2>(header_.normals);
    map.bounds_level_count = header_.bounds_level_count;
    for (int k = 0; k < header_.bounds_level_count; ++k)
      map.bounds[k] = {header_.bounds_columns[k], header_.bounds_rows[k], array<NormalBounds>(header_.bounds[k])};
    return map;
  }

  GLINT_HD NdfPyramid pyramid() const {
    NdfPyramid out;
    out.shape = shape();
    out.precision = static_cast<BlockPrecision>(header_.element_type);
    out.value_scale = header_.value_scale;
    for (int l = 0; l < header_.level_count; ++l) {
      const PackedArray* arrays = header_.arrays + 4 * l;
      out.levels[l] = {array<std::uint64_t>(arrays[0]), array<std::uint32_t>(arrays[1]), array<float>(arrays[2]),
                       base_ + arrays[3].offset};
    }
    return out;
  }

  GLINT_HD NdfCp ndfCp() const {
    const PackedArray* arrays = header_.arrays;
    NdfCp out;
    out.shape = shape();
    out.method = static_cast<CompressionMethod>(header_.method);
    out.coefficient_type = static_cast<CoefficientType>(header_.element_type);
    out.regions = header_.regions;
    out.places = header_.places;
    for (int l = 0; l < header_.level_count; ++l) out.first_image[l] = header_.levels[l].first_image;
    out.image_regions = array<std::uint16_t>(arrays[0]);
    out.image_slots = array<std::uint16_t>(arrays[1]);
    out.image_scales = array<float>(arrays[2]);
    out.clusters = array<NdfCluster>(arrays[3]);
    out.masks = array<std::uint64_t>(arrays[4]);
    out.mask_ranks = array<std::uint32_t>(arrays[5]);
    out.basis = array<std::int32_t>(arrays[6]);
    out.coefficients = base_ + arrays[7].offset;
    out.coefficient_count = arrays[7].count;
    out.scales = array<float>(arrays[8]);
    out.density_scales = array<float>(arrays[9]);
    out.block_masks = array<std::uint64_t>(arrays[10]);
    out.first_block = array<std::uint32_t>(arrays[11]);
    out.block_masses = array<std::uint8_t>(arrays[12]);
    out.block_places = array<std::uint16_t>(arrays[13]);
    out.place_blocks = array<std::uint16_t>(arrays[14]);
    out.core = array<std::uint8_t>(arrays[15]);
    out.spot_sums = array<float>(arrays[16]);
    out.floors = array<std::uint8_t>(arrays[17]);
    return out;
  }

 private:
  template <class T>
  GLINT_HD std::span<const T> array(const PackedArray& a) const {
    return {reinterpret_cast<const T*>(base_ + a.offset), static_cast<std::size_t>(a.count)};
  }

  GLINT_HD PyramidShape shape() const {
    PyramidShape out;
    out.width = header_.width;
    out.height = header_.height;
    out.resolution = header_.resolution;
    out.sigma_r = header_.sigma_r;
    out.surface = static_cast<Surface>(header_.surface);
    out.boundary = static_cast<Boundary>(header_.boundary);
    out.overlap = header_.overlap;
    out.level_count = header_.level_count;
    for (int l = 0; l < header_.level_count; ++l)
      out.levels[l] = {header_.levels[l].stride, header_.levels[l].columns, header_.levels[l].rows};
    out.slopes.mean = {header_.slope_mean[0], header_.slope_mean[1]};
    out.slopes.covariance = {header_.slope_covariance[0], header_.slope_covariance[1], header_.slope_covariance[2]};
    return out;
  }

  const PackedHeader& header_;
  const unsigned char* base_;
};

}  // namespace glint
