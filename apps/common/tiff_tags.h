#pragma once

#include <cstddef>
#include <optional>
#include <span>
#include <string>

namespace glint::apps {

/// The number that pixels without data hold in a GeoTIFF: GDAL's tag 42113, which OpenImageIO does not report.
/// @param directory  of the file, 0 for its first image
/// @return nothing if there is no such tag, it is no number, or the file is no TIFF
std::optional<double> geoTiffNoData(const std::string& path, int directory);

/// Whether a directory of a TIFF has no tag 258 (BitsPerSample). It then means 1 bit (TIFF 6.0), and OpenImageIO reads 8.
/// @return false if the file is no TIFF
bool lacksBitsPerSample(const std::string& path, int directory);

/// Orientation of a WebP image from its chunk of Exif metadata, which OpenImageIO does not read.
/// @return 1 if there is none, or the file is no WebP
int webpOrientation(const std::string& path);

/// Orientation of an image (1 to 8, tag 274) from Exif metadata, which have the form of a TIFF; 1 if they do not hold it.
int exifOrientation(std::span<const std::byte> exif);

}  // namespace glint::apps
