#pragma once

#include <cstddef>
#include <span>
#include <vector>

#include "glint/api/any_ndf.h"
#include "glint/model/packed_ndf.h"
#include "glint/query/packed_ndf_view.h"

namespace glint::api {

/// A model and all that its queries read as one linear buffer, ready to be uploaded: see glint/model/packed_ndf.h for the
/// layout, and PackedNdfView for asking it. Same bytes for the same model.
/// @param normals  map for footprints below level 0; nullptr: left out
std::vector<std::byte> pack(const NdfPyramid& pyramid, const NormalMap* normals = nullptr);
std::vector<std::byte> pack(const NdfCp& compressed, const NormalMap* normals = nullptr);
/// @param sigma_r  intrinsic roughness that it is asked with, disk units
std::vector<std::byte> pack(const NormalMap& normals, float sigma_r, Surface surface = Surface::flat,
                            Boundary boundary = Boundary::wrap);

/// Whatever was opened, with the normals that it was opened with.
/// @throws Error  unsupported: of a kind that has no packed form (bin-map, histogram-sat)
std::vector<std::byte> pack(const OpenedNdf& opened);

/// The models of a buffer that came from elsewhere, such as another process.
/// @param buffer  aligned to 16 bytes; must live as long as the view and its models
/// @throws Error  invalid_input: its magic, version or size are not those that pack() of this version writes
PackedNdfView viewPacked(std::span<const std::byte> buffer);

}  // namespace glint::api
