#pragma once

#include <nlohmann/json_fwd.hpp>
#include <optional>
#include <string>
#include <vector>

#include "common/files.h"
#include "common/keep_option.h"
#include "common/tool.h"
#include "glint/bake/compressed/compress.h"
#include "glint/formats/asset_reader.h"

namespace glint::apps {

/// The options of glint-compress.
class CompressOptions {
 public:
  explicit CompressOptions(Tool& tool);

  /// What was asked for. Valid after parsing.
  const bake::CompressionOptions& values() const { return values_; }

  /// The file of --normals for a map of the run; empty: none.
  /// @param tile  of a UDIM set; 0: none
  std::string normalsOf(int tile) const;

  /// Files that a tile is made of besides its pyramid.
  std::vector<std::string> readBy(int tile) const {
    const std::string normals = normalsOf(tile);
    return normals.empty() ? std::vector<std::string>() : std::vector<std::string>{normals};
  }

  /// The normals that the compressed asset of a pyramid keeps: those of --normals, or those that the pyramid keeps.
  /// @param asset     the pyramid
  /// @param path      its file
  /// @param normals   the map of --normals, if there is one; must outlive the result
  /// @throws Error invalid_input: --normals is not the map that the pyramid was made from; usage: there are no normals to keep
  std::optional<bake::NearNormalsData> kept(const formats::Asset& asset, const std::string& path, int tile,
                                            const std::optional<formats::Asset>& normals) const;

  /// Opens the map of --normals.
  std::optional<formats::Asset> openNormals(int tile) const;

 private:
  Tool& tool_;
  bake::CompressionOptions values_;
  KeepNormals keep_ = KeepNormals::as_input;
  std::string normals_;
};

/// Compresses images.
/// @param masses  CompressionOptions::image_masses
bake::NdfCpData compress(const NdfPyramid& pyramid, const std::vector<float>& masses, const CompressOptions& options,
                         bake::CompressionReport& report, Tool& tool);

/// The report as --json prints it. Sizes in bytes, errors relative.
nlohmann::json compressionJson(const bake::CompressionReport& report);

/// The report for people: one line for the whole and one for each level.
std::string compressionText(const bake::CompressionReport& report);

}  // namespace glint::apps
