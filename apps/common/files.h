#pragma once

#include <cstddef>
#include <span>
#include <string>
#include <vector>

#include "common/tool.h"
#include "glint/formats/asset_writer.h"

namespace glint::apps {

/// Mix-in: one positional input file, which must exist and be readable before the work starts.
class InputFile {
 public:
  InputFile(Tool& tool, const std::string& help, const std::string& name = "INPUT");
  const std::string& path() const { return path_; }

 private:
  std::string path_;
};

/// Mix-in: one or more positional input files.
class InputFiles {
 public:
  InputFiles(Tool& tool, const std::string& help, const std::string& name = "INPUT");
  const std::vector<std::string>& paths() const { return paths_; }

 private:
  std::vector<std::string> paths_;
};

/// What may be in a file that an output replaces.
enum class OutputFormat : unsigned char {
  asset,  ///< .glint
  image,  ///< any image format
  text,   ///< reports: JSON, CSV, ...
};

/// Mix-in: `-o OUTPUT` (required), written atomically. Checked before the work starts: its folder must exist and be writable.
///
/// An existing file is replaced without asking only if it looks like something that this tool wrote: an asset replaces an asset
/// (HDF5 signature), an image an image of a known format, a text any text file. Anything else, and an output that is one of
/// the inputs, needs --force. Folders and devices are refused.
class OutputFile {
 public:
  OutputFile(Tool& tool, OutputFormat format, const std::string& help, const std::string& name = "-o,--output");
  const std::string& path() const { return path_; }
  /// For writeAsset: what may be replaced was decided by the check before the work.
  formats::WriteOptions writeOptions() const { return {.overwrite = true}; }

 private:
  std::string path_;
};

/// Replaces a file by these bytes: unique temporary file in the same folder, fsync, rename. A failure leaves the old file.
/// @throws Error io
void writeFileAtomically(const std::string& path, std::span<const std::byte> bytes);
void writeFileAtomically(const std::string& path, const std::string& text);

/// Reads a whole file.
/// @throws Error io
std::vector<std::byte> readFile(const std::string& path);

/// A Make rule "targets: prerequisites", then an empty rule for each prerequisite so that deleting one is no error (as gcc
/// -MP). Blanks, '#', '%', ':' and '$' are escaped.
/// @throws Error usage if a name holds a line break, which Make cannot express
std::string makeDepfile(const std::vector<std::string>& targets, const std::vector<std::string>& prerequisites);

/// Throws Error io unless the path is a regular file (or pipe) that can be read.
void checkReadable(const std::string& path);

/// Throws Error io unless the path is a file that can be read, and more than once: no pipe and no device.
void checkRegular(const std::string& path);

/// Throws Error io unless a file can be made in the folder of this path.
void checkWritable(const std::string& path);

}  // namespace glint::apps
