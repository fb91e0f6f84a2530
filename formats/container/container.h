#pragma once

// Private to formats/: the part of HDF5 that assets use, read without HDF5.

#include <cstddef>
#include <cstdint>
#include <span>
#include <string>
#include <vector>

#include "glint/formats/container/object_header.h"

namespace glint::formats {

// Limits of SPEC.md, section 2.
inline constexpr std::size_t kMaxObjects = 4096;  ///< groups and datasets of a file
inline constexpr int kMaxDepth = 4;               ///< groups on a path, the root included

/// A group or dataset.
struct ContainerObject {
  std::string path;  ///< "/" for the root, else with the leading '/'
  ObjectHeader header;
};

/// All objects of a file. Points into the file.
struct Container {
  std::vector<ContainerObject> objects;  ///< the root first; a group before its objects
  std::vector<Extent> extents;  ///< superblock, parts of object headers, bytes of datasets: in order, apart from each other
};

/// Reads the superblock, and all object headers from the root on.
///
/// Safe on untrusted input: each offset is checked once, where it is read; allocates for what the limits allow only, and not by numbers
/// that the file holds. What is returned has right checksums, hard links only, and one link to every object.
/// @throws Error  the rule that is broken, most often file.hdf5
/// @note O(bytes of the headers); reads nothing outside `file`, and no bytes of datasets
Container readContainer(std::span<const std::byte> file);

}  // namespace glint::formats
