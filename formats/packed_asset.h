#pragma once

// Private to formats/: an asset on its way into a file.

#include <cstdint>
#include <string>
#include <string_view>
#include <utility>
#include <vector>

#include "glint/formats/file_pieces.h"
#include "glint/formats/structure.h"

namespace glint::formats {

/// One dataset to write.
struct PackedArray {
  std::string path;  ///< from the root without a leading '/'
  ElementType type = ElementType::f32;
  std::vector<std::uint64_t> dims;
  const void* data = nullptr;
  std::uint64_t size_bytes = 0;
  std::string_view units;
  std::string_view long_name;
  ByteSource source = {};  ///< gives the bytes where they are not in memory; `data` is then not followed
};

/// An asset as attributes and arrays, in the order of the schema. Points into the struct that it was made from.
struct PackedAsset {
  std::string_view kind;
  std::vector<std::pair<std::string, AttributeValue>> attributes;
  std::vector<PackedArray> arrays;
};

}  // namespace glint::formats
