#pragma once

// Private to formats/: object headers of HDF5, version 2.

#include <cstddef>
#include <cstdint>
#include <span>
#include <string>
#include <string_view>
#include <vector>

namespace glint::formats {

/// Bytes of a file that belong to one object: from `begin` to before `end`.
struct Extent {
  std::uint64_t begin = 0;
  std::uint64_t end = 0;
};

// Limits of SPEC.md, section 2.
inline constexpr std::size_t kMaxParts = 256;             ///< parts of an object header
inline constexpr std::size_t kMaxLinks = 1024;            ///< links of a group
inline constexpr std::size_t kMaxNameBytes = 255;         ///< bytes of the name of a link or attribute
inline constexpr std::size_t kMaxAttributes = 64;         ///< attributes of an object
inline constexpr std::size_t kMaxAttributeBytes = 65536;  ///< bytes of an attribute's value

/// An attribute message: its name, and its parts as they are in the file.
struct RawAttribute {
  std::string_view name;
  std::span<const std::byte> element;  ///< datatype message
  std::span<const std::byte> extents;  ///< dataspace message
  std::span<const std::byte> value;    ///< to the end of the attribute's message
  bool committed = false;              ///< the datatype or dataspace is elsewhere
};

/// A link to another object header.
struct RawLink {
  std::string_view name;
  std::uint64_t address = 0;
};

/// A rule that an object breaks, found in a message that need not be read further.
struct Breach {
  std::string_view rule;
  std::string_view message;
};

/// What the messages of one object header say. Points into the file.
struct ObjectHeader {
  bool is_group = false;  ///< else it is a dataset
  std::vector<RawLink> links;
  std::vector<RawAttribute> attributes;
  std::vector<Breach> breaches;

  // Of a dataset.
  std::span<const std::byte> element;  ///< datatype message
  std::span<const std::byte> extents;  ///< dataspace message
  std::uint64_t place = 0;             ///< offset of the bytes; kNowhere if there are none
  std::uint64_t size_bytes = 0;        ///< bytes that are reserved there
};

inline constexpr std::uint64_t kNowhere = ~std::uint64_t{0};

/// Reads the object header at an address of a file.
///
/// Every offset is compared with the end of the file once, where it is read; the checksum of every part of the header is compared.
/// @param object  path of the object, for messages
/// @param parts   receives the parts of the header; their bytes, with those that are there, may not be more than the file has
/// @throws Error  the rule that is broken, most often file.hdf5
/// @note O(bytes of the header)
ObjectHeader readObjectHeader(std::span<const std::byte> file, std::uint64_t address, const std::string& object,
                              std::vector<Extent>& parts);

/// Compares the last four bytes of a part of the metadata with the checksum of the bytes before. Throws Error (file.hdf5).
void requireChecksum(std::span<const std::byte> part, const std::string& object, const char* what);

}  // namespace glint::formats
