#pragma once

#include <nlohmann/json_fwd.hpp>
#include <string>

#include "common/image_input.h"
#include "common/tool.h"
#include "glint/bake/ingest/ingest.h"

namespace glint::apps {

/// The options of glint-ingest.
class IngestOptions {
 public:
  explicit IngestOptions(Tool& tool);

  /// Complete options for one image, which may name the number for no data itself. Call after parsing.
  bake::IngestOptions values(Tool& tool, const std::string& name, const Image& image) const;

  /// Reads the image that the options choose.
  /// @param of_any_size  whether pixels may take more than the memory that is there (IngestMemory)
  Image read(Tool& tool, const std::string& path, bool of_any_size) const;

  /// Warns of what was changed on the way in, and of a number of --nodata that no texel holds.
  /// @param no_data   the number that marked texels without data, if any
  /// @param boundary  of the heights
  void warnAbout(Tool& tool, const std::string& name, const std::optional<double>& no_data, Boundary boundary,
                 const bake::IngestReport& report) const;

  /// Makes the options those of a UDIM set, which ends where it has no tile.
  /// @throws Error usage for --boundary wrap
  bake::IngestOptions tileValues(Tool& tool, const std::string& name, const Image& image) const;

  bool readsHeights() const { return kind_ == Kind::height; }
  bool writesHeights() const { return to_ == To::heights; }
  float texelSize() const { return texel_size_um_; }

 private:
  enum class Kind : unsigned char { normal, height };
  enum class To : unsigned char { normals, heights };

  Kind kind_ = Kind::normal;
  To to_ = To::normals;
  bake::IngestOptions values_;
  float height_scale_um_ = 1;
  float texel_size_um_ = 0;
  std::string no_data_ = "auto";
  Option* height_scale_um_option_;
  Option* boundary_option_;
  ImageOptions image_;
};

/// The pixels of an image as the builders take them. Refers to the image.
bake::PixelArray pixelArray(const Image& image);

/// The report as JSON, for --json.
nlohmann::json reportJson(const bake::IngestReport& report);

/// The report as a few lines, for --verbose.
std::string reportText(const std::string& name, const Image& image, const bake::IngestReport& report);

}  // namespace glint::apps
