#pragma once

#include "glint/api/models/levels.h"
#include "glint/query/cp_ndf.h"

namespace glint::api {

template <>
struct NdfTraits<AnisotropicNdf<CpNdf>> {
  using Asset = NdfCp;
  static constexpr std::string_view kKind = formats::kKindName<Asset>;

  static AnisotropicNdf<CpNdf> open(const NdfSource<NdfCp>& source) { return openLevels<CpNdf>(source); }
  static NdfInfo info(const NdfSource<NdfCp>& source) { return levelsInfo(source.asset.shape, hasNormals(source)); }
  static MapSlopes slopes(const NdfCp& ndf) { return ndf.shape.slopes; }

  static constexpr bool kPacks = true;
  static void pack(const NdfSource<NdfCp>& source, Packer& packer) {
    const NdfCp& ndf = source.asset;
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
    header.arrays[6] = packer.add(ndf.basis);
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
    header.arrays[17] = packer.add(ndf.floors);
    packer.addNormalsOf(source.normals, ndf.near_normals);
  }
};

}  // namespace glint::api
