#pragma once

// Private to formats/: datatype and dataspace messages of HDF5.

#include <cstddef>
#include <cstdint>
#include <optional>
#include <span>
#include <string>
#include <vector>

#include "glint/formats/schema.h"

namespace glint::formats {

/// What a datatype message says.
struct Element {
  std::optional<ElementType> type;  ///< none: no schema uses the type
  std::uint64_t size = 0;           ///< bytes of an element, more than 0
  bool variable = false;            ///< variable length or a reference, or a compound with such a member
};

/// Reads a datatype message.
/// @throws Error  file.hdf5: the message is not of a form that HDF5 1.8 and later write
Element readElement(std::span<const std::byte> message, const std::string& object);

/// What a dataspace message says.
struct Extents {
  bool null = false;                ///< no elements at all, not even of a list
  std::vector<std::uint64_t> dims;  ///< empty for a scalar; at most kMaxDims
  std::uint64_t count = 1;          ///< product of the sizes
};

inline constexpr std::uint64_t kMaxDims = 8;  ///< of datasets; SPEC.md, section 2

/// Reads a dataspace message.
/// @throws Error  file.hdf5; dataset.dims: more than kMaxDims sizes; dataset.storage: the product of the sizes overflows
Extents readExtents(std::span<const std::byte> message, const std::string& object);

}  // namespace glint::formats
