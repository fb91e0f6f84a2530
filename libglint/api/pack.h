#pragma once

#include <cstddef>
#include <span>
#include <vector>

#include "glint/api/any_ndf.h"
#include "glint/model/packed_ndf.h"
#include "glint/query/packed_ndf_view.h"

namespace glint::api {

/// Writes a model and all arrays that its queries read into one linear buffer, ready to be uploaded. glint/model/packed_ndf.h
/// has the layout; PackedNdfView makes models of the buffer. The same model gives the same bytes.
/// @param normals  map for footprints below level 0; nullptr: left out
std::vector<std::byte> pack(const NdfPyramid& pyramid, const NormalMap* normals = nullptr);
std::vector<std::byte> pack(const NdfCp& compressed, const NormalMap* normals = nullptr);
/// @param sigma_r  intrinsic roughness of the facets, disk units
std::vector<std::byte> pack(const NormalMap& normals, float sigma_r, Surface surface = Surface::flat,
                            Boundary boundary = Boundary::wrap);

/// Packs an opened asset of any kind, with the normals that it was opened with.
/// @throws Error  unsupported: the kind has no packed form (NdfTraits::kPacks)
std::vector<std::byte> pack(const OpenedNdf& opened);

/// Views a buffer that comes from elsewhere, such as another process.
/// @param buffer  aligned to 16 bytes; must live as long as the view and its models
/// @throws Error  invalid_input: pack() of this version does not write this magic, version or size
PackedNdfView viewPacked(std::span<const std::byte> buffer);

}  // namespace glint::api
