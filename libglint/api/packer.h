#pragma once

#include <cstddef>
#include <cstring>
#include <optional>
#include <span>
#include <utility>
#include <vector>

#include "glint/model/ndf_pyramid.h"
#include "glint/model/packed_ndf.h"

namespace glint::api {

/// Appends arrays to a packed buffer whose header is written last.
class Packer {
 public:
  Packer() : bytes_(sizeof(PackedHeader)) {
    header_.magic = kPackedMagic;
    header_.version = kPackedVersion;
  }

  PackedHeader& header() { return header_; }

  /// Appends an array. Returns its place, for the header.
  template <class T>
  PackedArray add(std::span<const T> values) {
    return addBytes(values.data(), values.size(), sizeof(T));
  }

  /// Appends an array whose elements have no type of their own.
  PackedArray addBytes(const void* values, std::size_t count, std::size_t element_bytes) {
    if (count == 0) return {bytes_.size(), 0};
    const PackedArray array = {bytes_.size(), count};
    const std::size_t size = count * element_bytes;
    bytes_.resize((bytes_.size() + size + kPackedAlignment - 1) / kPackedAlignment * kPackedAlignment);
    std::memcpy(bytes_.data() + array.offset, values, size);
    return array;
  }

  /// Fills the members of the header that pyramids and compressed pyramids share.
  void addShape(const PyramidShape& shape) {
    header_.width = shape.width;
    header_.height = shape.height;
    header_.resolution = shape.resolution;
    header_.sigma_r = shape.sigma_r;
    header_.surface = static_cast<std::uint32_t>(shape.surface);
    header_.boundary = static_cast<std::uint32_t>(shape.boundary);
    header_.overlap = shape.overlap;
    header_.level_count = shape.level_count;
    header_.slope_mean[0] = shape.slopes.mean.x;
    header_.slope_mean[1] = shape.slopes.mean.y;
    header_.slope_covariance[0] = shape.slopes.covariance.xx;
    header_.slope_covariance[1] = shape.slopes.covariance.xy;
    header_.slope_covariance[2] = shape.slopes.covariance.yy;
    for (int l = 0; l < shape.level_count; ++l)
      header_.levels[l] = {shape.levels[l].stride, shape.levels[l].columns, shape.levels[l].rows, 0};
  }

  /// Appends a normal map and its bounds.
  void addNormals(const NormalMap& map) {
    header_.width = map.width;
    header_.height = map.height;
    header_.texel_size_um = map.texel_size_um;
    addNearNormals(map);
  }

  /// Appends the normals for footprints below level 0, if there are any: those that were given, or else those that the asset keeps.
  void addNormalsOf(const NormalMap* given, const std::optional<NearNormals>& kept) {
    if (given != nullptr)
      addNormals(*given);
    else if (kept)
      addNearNormals(*kept);
  }

  /// The buffer. Ends the use of the packer.
  std::vector<std::byte> finish() {
    header_.size_bytes = bytes_.size();
    std::memcpy(bytes_.data(), &header_, sizeof header_);
    return std::move(bytes_);
  }

 private:
  void addNearNormals(const NearNormals& near) {
    header_.near_type = static_cast<std::uint32_t>(near.type);
    header_.near_step = near.step;
    const auto texels = static_cast<std::size_t>(near.width) * static_cast<std::size_t>(near.height);
    header_.normals = addBytes(near.texels, texels, normalBytes(near.type));
    header_.bounds_level_count = near.bounds_level_count;
    for (int k = 0; k < near.bounds_level_count; ++k) {
      header_.bounds_columns[k] = near.bounds[k].columns;
      header_.bounds_rows[k] = near.bounds[k].rows;
      header_.bounds[k] = addBytes(near.bounds[k].nodes, near.bounds[k].size(), boundsBytes(near.type));
    }
  }

  PackedHeader header_ = {};
  std::vector<std::byte> bytes_;
};

}  // namespace glint::api
