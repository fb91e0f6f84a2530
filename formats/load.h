#pragma once

// Private to formats/: the one checker behind Asset::open and validateAsset.

#include <optional>

#include "glint/formats/asset_reader.h"
#include "glint/formats/findings.h"
#include "glint/formats/kinds/kind.h"
#include "glint/formats/structure.h"

namespace glint::formats {

/// A file that was read and checked. `asset` and `kind` are set only if nothing is broken.
struct LoadedAsset {
  FileStructure structure;
  AssetInfo info;
  std::optional<AnyAsset> asset;
  const Kind* kind = nullptr;
};

/// Reads a file and checks structure, schema and indices. Broken rules are added to `findings`.
LoadedAsset loadAsset(const std::filesystem::path& path, Findings& findings);

/// Compares every dataset with its hash attribute, and the bytes between objects with 0: then every bit of the file is checked.
void checkHashes(const LoadedAsset& loaded, Findings& findings);

}  // namespace glint::formats
