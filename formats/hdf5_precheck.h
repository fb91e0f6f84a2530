#pragma once

// Private to formats/.

#include <cstddef>
#include <cstdint>
#include <span>
#include <vector>

namespace glint::formats {

/// Bytes of a file that belong to one object: from `begin` to before `end`.
struct Extent {
  std::uint64_t begin = 0;
  std::uint64_t end = 0;
};

/// Where the objects of a file are.
struct ObjectPlaces {
  std::vector<Extent> extents;  ///< superblock, parts of object headers, and bytes of datasets, in order
  bool complete = false;        ///< whether these are all; not if links or attributes are in heaps, which are not looked into
};

/// Walks all object headers from the root, before HDF5 does: HDF5 1.10 trusts a good part of what it reads, and a checksum
/// keeps out accidents only. What passes has headers of version 2 with right checksums, and in them only messages that SPEC.md has a
/// use for, each of a known version and whole: hard links to objects inside the file, one for each; numbers, texts and
/// compounds of these; sizes whose bytes are there; contiguous datasets.
///
/// Superblock: version 2 or 3, checked before. Heaps of links or attributes (which files with more of these than fit into a
/// header may have) are only found to be there.
/// @throws Error  the rule that is broken, most often file.hdf5
/// @note O(bytes of the headers); reads nothing outside `file`
ObjectPlaces checkObjectHeaders(std::span<const std::byte> file);

}  // namespace glint::formats
