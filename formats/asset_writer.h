#pragma once

#include <filesystem>
#include <optional>

#include "glint/formats/kinds.h"
#include "glint/formats/provenance.h"
#include "glint/formats/udim.h"
#include "glint/model/error.h"

namespace glint::formats {

struct WriteOptions {
  bool overwrite = false;  ///< replace a file that exists
  /// Tile of a UDIM set that the asset covers. The width and height of the asset are those with margins.
  std::optional<UdimPlace> udim = {};
};

/// Writes an asset of any kind, e.g. writeAsset(path, normal_map, provenance). The file appears whole or not at all: it is
/// written under a temporary name, read back and checked as a
/// reader would, and then given its name as AtomicFile does, which also says what happens to links, permissions, devices and
/// pipes. On failure the temporary file is removed and an old file stays; what a killed run leaves under a temporary name, the
/// next run that writes the same file removes. The same arguments give the same bytes; bytes between the objects of a file are
/// zero.
/// @throws Error  io: cannot be written, or exists and may not be replaced; usage: an array does not have the size that the
///                struct says; failed: the struct breaks a rule of the format (its id is in the error)
void writeAsset(const std::filesystem::path& path, const AnyAsset& asset, const Provenance& provenance,
                const WriteOptions& options = {});

}  // namespace glint::formats
