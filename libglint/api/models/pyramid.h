#pragma once

#include "glint/api/models/levels.h"
#include "glint/query/pyramid_ndf.h"

namespace glint::api {

template <>
struct NdfTraits<AnisotropicNdf<PyramidNdf>> {
  using Asset = NdfPyramid;
  static constexpr std::string_view kKind = formats::kKindName<Asset>;

  static AnisotropicNdf<PyramidNdf> open(const NdfSource<NdfPyramid>& source) { return openLevels<PyramidNdf>(source); }
  static NdfInfo info(const NdfSource<NdfPyramid>& source) { return levelsInfo(source.asset.shape, hasNormals(source)); }
  static MapSlopes slopes(const NdfPyramid& pyramid) { return pyramid.shape.slopes; }

  static constexpr bool kPacks = true;
  static void pack(const NdfSource<NdfPyramid>& source, Packer& packer) {
    const NdfPyramid& pyramid = source.asset;
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
    packer.addNormalsOf(source.normals, pyramid.near_normals);
  }
};

}  // namespace glint::api
