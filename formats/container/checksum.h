#pragma once

// Private to formats/.

#include <cstddef>
#include <cstdint>
#include <span>

namespace glint::formats {

/// Checksum of HDF5's metadata: Jenkins' lookup3 ("hashlittle") with seed 0.
/// @see the HDF5 file format specification, "Computation of checksums"; burtleburtle.net/bob/c/lookup3.c, public domain
std::uint32_t hdf5Checksum(std::span<const std::byte> bytes);

}  // namespace glint::formats
