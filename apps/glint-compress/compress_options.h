#pragma once

#include <nlohmann/json_fwd.hpp>
#include <string>
#include <vector>

#include "common/tool.h"
#include "glint/bake/compressed/compress.h"

namespace glint::apps {

/// The options of glint-compress.
class CompressOptions {
 public:
  explicit CompressOptions(Tool& tool);

  /// What was asked for. Valid after parsing.
  const bake::CompressionOptions& values() const { return values_; }

 private:
  bake::CompressionOptions values_;
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
