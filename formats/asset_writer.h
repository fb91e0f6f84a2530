#pragma once

#include <filesystem>

#include "glint/formats/provenance.h"
#include "glint/model/bin_map.h"
#include "glint/model/displacement.h"
#include "glint/model/error.h"
#include "glint/model/histogram_sat.h"
#include "glint/model/ndf_cp.h"
#include "glint/model/ndf_pyramid.h"
#include "glint/model/normal_map.h"
#include "glint/model/sh.h"

namespace glint::formats {

struct WriteOptions {
  bool overwrite = false;  ///< replace a file that exists
};

/// Writes an asset. The file appears whole or not at all: it is written under a temporary name, read back and checked as a
/// reader would, and then given its name as AtomicFile does, which also says what happens to links, permissions, devices and
/// pipes. On failure the temporary file is removed and an old file stays; what a killed run leaves under a temporary name, the
/// next run that writes the same file removes. The same arguments give the same bytes; bytes between the objects of a file are
/// zero.
/// @throws Error  io: cannot be written, or exists and may not be replaced; usage: an array does not have the size that the
///                struct says; failed: the struct breaks a rule of the format (its id is in the error)
void writeAsset(const std::filesystem::path& path, const NormalMap& map, const Provenance& provenance,
                const WriteOptions& options = {});
void writeAsset(const std::filesystem::path& path, const HeightMap& map, const Provenance& provenance,
                const WriteOptions& options = {});
void writeAsset(const std::filesystem::path& path, const NdfPyramid& pyramid, const Provenance& provenance,
                const WriteOptions& options = {});
void writeAsset(const std::filesystem::path& path, const NdfCp& ndf, const Provenance& provenance,
                const WriteOptions& options = {});
void writeAsset(const std::filesystem::path& path, const BinMap& map, const Provenance& provenance,
                const WriteOptions& options = {});
void writeAsset(const std::filesystem::path& path, const HistogramSat& sat, const Provenance& provenance,
                const WriteOptions& options = {});
void writeAsset(const std::filesystem::path& path, const ShLight& light, const Provenance& provenance,
                const WriteOptions& options = {});
void writeAsset(const std::filesystem::path& path, const ShLobes& lobes, const Provenance& provenance,
                const WriteOptions& options = {});
void writeAsset(const std::filesystem::path& path, const Displacement& displacement, const Provenance& provenance,
                const WriteOptions& options = {});

}  // namespace glint::formats
