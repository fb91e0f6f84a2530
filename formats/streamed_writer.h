#pragma once

#include <map>
#include <string>

#include "glint/formats/asset_writer.h"
#include "glint/formats/file_pieces.h"

namespace glint::formats {

/// Sources of the bytes of arrays, by the path of the dataset, such as "/level_00/pixels".
using ByteSources = std::map<std::string, ByteSource>;

/// A span of `count` elements that are not in memory: only its size means something.
template <class T>
std::span<const T> spanOfSize(std::size_t count) {
  // Not null, which writers refuse where there are elements.
  return {reinterpret_cast<const T*>(alignof(T)), count};
}

/// Writes an asset as writeAsset() does, with arrays that are not in memory: their bytes come from sources, in pieces, so that an
/// asset may be larger than memory. The file is the same.
/// @param asset    the pointers of arrays that have a source are not followed: see spanOfSize()
/// @param sources  each is called twice, for the hash and for the bytes, and must give as many bytes as the array has
/// @throws Error  as writeAsset(), and what sources throw; failed if a source gives another number of bytes
void writeStreamedAsset(const std::filesystem::path& path, const AnyAsset& asset, const Provenance& provenance,
                        const ByteSources& sources, const WriteOptions& options = {});

}  // namespace glint::formats
