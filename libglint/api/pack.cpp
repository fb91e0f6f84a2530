#include "glint/api/pack.h"

#include <cstdint>
#include <cstring>
#include <string>

namespace glint::api {
namespace {

/// Appends arrays to a buffer whose header is written last.
class Packer {
 public:
  Packer() : bytes_(sizeof(PackedHeader)) {
    header_.magic = kPackedMagic;
    header_.version = kPackedVersion;
  }

  PackedHeader& header() { return header_; }

  template <class T>
  PackedArray add(std::span<const T> values) {
    return addBytes(values.data(), values.size(), sizeof(T));
  }

  PackedArray addBytes(const void* values, std::size_t count, std::size_t element_bytes) {
    if (count == 0) return {bytes_.size(), 0};
    const PackedArray array = {bytes_.size(), count};
    const std::size_t size = count * element_bytes;
    bytes_.resize((bytes_.size() + size + kPackedAlignment - 1) / kPackedAlignment * kPackedAlignment);
    std::memcpy(bytes_.data() + array.offset, values, size);
    return array;
  }

  void addShape(const PyramidShape& shape) {
    header_.width = shape.width;
    header_.height = shape.height;
    header_.resolution = shape.resolution;
    header_.sigma_r = shape.sigma_r;
    header_.surface = static_cast<std::uint32_t>(shape.surface);
    header_.boundary = static_cast<std::uint32_t>(shape.boundary);
    header_.level_count = shape.level_count;
    header_.slope_mean[0] = shape.slopes.mean.x;
    header_.slope_mean[1] = shape.slopes.mean.y;
    header_.slope_covariance[0] = shape.slopes.covariance.xx;
    header_.slope_covariance[1] = shape.slopes.covariance.xy;
    header_.slope_covariance[2] = shape.slopes.covariance.yy;
    for (int l = 0; l < shape.level_count; ++l)
      header_.levels[l] = {shape.levels[l].stride, shape.levels[l].columns, shape.levels[l].rows, 0};
  }

  void addNormals(const NormalMap& map) {
    header_.width = map.width;
    header_.height = map.height;
    header_.texel_size_um = map.texel_size_um;
    header_.normals = add(map.normals);
    header_.bounds_level_count = map.bounds_level_count;
    for (int k = 0; k < map.bounds_level_count; ++k) {
      header_.bounds_columns[k] = map.bounds[k].columns;
      header_.bounds_rows[k] = map.bounds[k].rows;
      header_.bounds[k] = add(map.bounds[k].nodes);
    }
  }

  std::vector<std::byte> finish() {
    header_.size_bytes = bytes_.size();
    std::memcpy(bytes_.data(), &header_, sizeof header_);
    return std::move(bytes_);
  }

 private:
  PackedHeader header_ = {};
  std::vector<std::byte> bytes_;
};

}  // namespace

std::vector<std::byte> pack(const NdfPyramid& pyramid, const NormalMap* normals) {
  Packer packer;
  PackedHeader& header = packer.header();
  header.kind = PackedKind::pyramid;
  header.element_type = static_cast<std::uint32_t>(pyramid.precision);
  header.value_scale = pyramid.value_scale;
  packer.addShape(pyramid.shape);
  for (int l = 0; l < pyramid.shape.level_count; ++l) {
    const PyramidLevel& level = pyramid.levels[l];
    PackedArray* arrays = header.arrays + 4 * l;
    arrays[0] = packer.add(level.masks);
    arrays[1] = packer.add(level.mask_ranks);
    arrays[2] = packer.add(level.block_means);
    arrays[3] = packer.addBytes(level.pixels, level.block_means.size() * kBlockPixels, pixelBytes(pyramid.precision));
  }
  if (normals != nullptr) packer.addNormals(*normals);
  return packer.finish();
}

std::vector<std::byte> pack(const NdfCp& ndf, const NormalMap* normals) {
  Packer packer;
  PackedHeader& header = packer.header();
  header.kind = PackedKind::compressed;
  header.element_type = static_cast<std::uint32_t>(ndf.coefficient_type);
  header.method = static_cast<std::uint32_t>(ndf.method);
  header.regions = ndf.regions;
  header.places = ndf.places;
  packer.addShape(ndf.shape);
  for (int l = 0; l < ndf.shape.level_count; ++l) header.levels[l].first_image = ndf.first_image[l];
  header.arrays[0] = packer.add(ndf.image_regions);
  header.arrays[1] = packer.add(ndf.image_slots);
  header.arrays[2] = packer.add(ndf.image_scales);
  header.arrays[3] = packer.add(ndf.clusters);
  header.arrays[4] = packer.add(ndf.masks);
  header.arrays[5] = packer.add(ndf.mask_ranks);
  header.arrays[6] = packer.addBytes(ndf.basis, ndf.basis_count, basisBytes(ndf.method, ndf.coefficient_type));
  header.arrays[7] = packer.addBytes(ndf.coefficients, ndf.coefficient_count, coefficientBytes(ndf.coefficient_type));
  header.arrays[8] = packer.add(ndf.scales);
  header.arrays[9] = packer.add(ndf.density_scales);
  header.arrays[10] = packer.add(ndf.block_masks);
  header.arrays[11] = packer.add(ndf.first_block);
  header.arrays[12] = packer.add(ndf.block_masses);
  header.arrays[13] = packer.add(ndf.block_places);
  header.arrays[14] = packer.add(ndf.place_blocks);
  header.arrays[15] = packer.add(ndf.core);
  header.arrays[16] = packer.add(ndf.spot_sums);
  if (normals != nullptr) packer.addNormals(*normals);
  return packer.finish();
}

std::vector<std::byte> pack(const NormalMap& normals, float sigma_r, Surface surface, Boundary boundary) {
  Packer packer;
  packer.header().kind = PackedKind::normals;
  packer.header().sigma_r = sigma_r;
  packer.header().surface = static_cast<std::uint32_t>(surface);
  packer.header().boundary = static_cast<std::uint32_t>(boundary);
  packer.addNormals(normals);
  return packer.finish();
}

std::vector<std::byte> pack(const OpenedNdf& opened) {
  using Buffer = std::vector<std::byte>;
  const formats::Asset& asset = opened.asset();
  const NormalMap* normals = opened.normals();
  const auto refuse = [&]() -> Buffer {
    throw Error(ErrorCode::unsupported, "format.kind", opened.path().string(), "",
                "is of kind " + std::string(asset.kind()) + ", which has no packed form",
                "pack an asset of kind normals, ndf-pyramid or ndf-cp");
  };
  // A new kind is a line here, and an overload above.
  return std::visit(Overloaded{[&](const Reference&) {
                                 const NdfInfo& info = opened.info();
                                 return pack(asset.get<NormalMap>(), info.sigma_r, info.surface, info.boundary);
                               },
                               [&](const AnisotropicNdf<PyramidNdf>&) { return pack(asset.get<NdfPyramid>(), normals); },
                               [&](const AnisotropicNdf<CpNdf>&) { return pack(asset.get<NdfCp>(), normals); },
                               [&](const BinMapNdf&) { return refuse(); }, [&](const HistogramNdf&) { return refuse(); }},
                    opened.model());
}

PackedNdfView viewPacked(std::span<const std::byte> buffer) {
  const auto refuse = [](const std::string& fault) {
    throw Error(ErrorCode::invalid_input, "packed.header", {}, {}, fault, "make the buffer with the same version of glint");
  };
  if (buffer.size() < sizeof(PackedHeader))
    refuse("a packed buffer of " + std::to_string(buffer.size()) + " bytes has no header");
  if (reinterpret_cast<std::uintptr_t>(buffer.data()) % 16 != 0) refuse("a packed buffer is not aligned to 16 bytes");
  const auto& header = *reinterpret_cast<const PackedHeader*>(buffer.data());
  if (header.magic != kPackedMagic) refuse("this is no packed buffer");
  if (header.version != kPackedVersion)
    refuse("a packed buffer has version " + std::to_string(header.version) + ", not " + std::to_string(kPackedVersion));
  if (header.size_bytes != buffer.size()) refuse("a packed buffer is not whole");
  return PackedNdfView(buffer.data());
}

}  // namespace glint::api
