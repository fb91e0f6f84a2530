#pragma once

#include <cstdint>
#include <string>
#include <vector>

#include "common/files.h"
#include "common/tool.h"
#include "glint/formats/asset_reader.h"
#include "glint/model/ndf_pyramid_shard.h"

namespace glint::apps {

/// Shards of one pyramid: all regions, in order.
class Shards {
 public:
  /// Opens shards and checks that they are all regions of one pyramid. Hashes and values are checked of one shard after the other.
  /// @throws Error usage: a region is missing or given twice; invalid_input: shards of different runs; unsupported: another kind.
  ///               Each names the file
  Shards(const Tool& tool, const std::vector<std::string>& paths);

  const std::vector<NdfPyramidShard>& views() const { return views_; }
  /// The record of the pyramid: the one of a run of glint-pyramid without --region.
  const formats::Provenance& record() const { return record_; }
  const formats::AssetInfo& info(std::size_t shard) const { return files_[shard].asset.info(); }
  const std::string& path(std::size_t shard) const { return files_[shard].path; }

 private:
  struct File {
    std::string path;
    formats::Asset asset;
    formats::Provenance record;  ///< without the region
  };

  static void requireSameRun(const File& file, const File& first);
  void requireAllRegions() const;

  std::vector<File> files_;
  std::vector<NdfPyramidShard> views_;
  formats::Provenance record_;
};

/// What shards were joined to.
struct JoinedPyramid {
  PyramidShape shape;
  std::uint64_t near_bytes = 0;  ///< of the normals that it keeps, and of their bounds
};

/// Joins shards and writes the pyramid. Images go from file to file in pieces, and are never in memory together. Indices and kept
/// normals are in memory of the default resource.
JoinedPyramid writeJoined(const Shards& shards, const OutputFile& output);

}  // namespace glint::apps
