#pragma once

// Private to formats/: the one checker behind Asset::open and validateAsset.

#include <cstdint>
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

/// Checks structure, schema and indices of the bytes of a file. Broken rules are added to `findings`.
LoadedAsset loadAsset(FileBytes bytes, Findings& findings);

/// The same for the file at the path of `findings`. Where it cannot be read, that is a finding, too.
LoadedAsset loadFile(Findings& findings, bool copy = false);

/// Checks the values of the kind, and the texts that all kinds have. Only for assets without a broken rule.
void checkValues(const LoadedAsset& loaded, Findings& findings);

/// Where checkHashes() reads the bytes of datasets: as they are in memory, or in pieces from the file.
enum class HashFrom : std::uint8_t { memory, file };

/// Compares the asset with its digest, every dataset with its hash, and the bytes between objects with 0: then every bit of the
/// file is checked.
void checkHashes(const LoadedAsset& loaded, Findings& findings, HashFrom from = HashFrom::memory);

}  // namespace glint::formats
