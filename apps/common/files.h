#pragma once

#include <cstddef>
#include <optional>
#include <span>
#include <string>
#include <string_view>
#include <vector>

#include "common/tool.h"
#include "glint/formats/asset_writer.h"

namespace glint::apps {

/// Whether a tool takes UDIM sets, whose files are named by one pattern, such as name.<UDIM>.exr.
enum class UdimSets : unsigned char { refused, taken };

/// Refuses the pattern of a UDIM set in a tool that does not take sets, or the asset of a tile in one that does not know margins.
/// @throws Error unsupported, which names the tools that take sets
[[noreturn]] void refuseUdim(const std::string& path, const std::string& what);

/// Refuses the asset of a tile of a UDIM set, in a tool that does not know its margins.
/// @throws Error unsupported
[[noreturn]] void refuseTile(const Tool& tool, const std::string& path);

/// The files that a path stands for: itself, or those of the tiles of a set. They are readable, and inputs of the tool from now on.
/// @throws Error unsupported: a set, where sets are refused; as checkRegular and formats::udimTiles
std::vector<std::string> addInputs(Tool& tool, const std::string& path, UdimSets sets);

/// Mix-in: one positional input file, which must exist and be readable before the work starts; or the files of a UDIM set.
class InputFile {
 public:
  InputFile(Tool& tool, const std::string& help, const std::string& name = "INPUT", UdimSets sets = UdimSets::refused);
  /// The file, or the pattern of a set.
  const std::string& path() const { return path_; }
  /// Tiles of a set that have a file, ascending; none for a file.
  const std::vector<int>& tiles() const { return tiles_; }
  bool isSet() const { return !tiles_.empty(); }

 private:
  std::string path_;
  std::vector<int> tiles_;
};

/// Mix-in: positional input files, one or more, or any number where they are not required.
class InputFiles {
 public:
  InputFiles(Tool& tool, const std::string& help, const std::string& name, bool required, UdimSets sets = UdimSets::refused);
  /// The files; the pattern of a UDIM set stands for the files of its tiles.
  const std::vector<std::string>& paths() const { return paths_; }

 private:
  std::vector<std::string> paths_;
};

/// The content of an output. It decides which files the output may replace.
enum class OutputFormat : unsigned char {
  asset,        ///< .glint
  image,        ///< any image format
  table,        ///< CSV with answers
  depfile,      ///< rule for Make
  results,      ///< JSON of glint-bench
  page,         ///< HTML of glint-bench
  plan,         ///< JSON of glint-plan
  plan_rules,   ///< Makefile of glint-plan
  manifest,     ///< JSON of glint-farm
  farm_log,     ///< JSON lines of glint-farm, which grow
  test_report,  ///< JUnit XML or SARIF of glint-validate
};

/// Checks an output before the work starts. Checks again, when all inputs and outputs are known, that no other file of the run
/// has its name.
///
/// The folder must exist and be writable; symbolic links are followed. Devices and pipes are written to; folders, disks and
/// sockets are refused. Without --force an output replaces a file only if the file can be written (a mode of 0444 holds for root
/// too), is no input, and holds an earlier result of the same format: an asset, an image of a known format, a table with the
/// columns of answers or samples, a depfile. An empty file may always be replaced. With --skip-unchanged an asset is judged so only
/// when it is made again: a finished asset may be read-only.
/// @throws Error io, usage
void checkOutput(Tool& tool, const std::string& path, OutputFormat format);

/// Checks that a file which is there may be replaced by an output, as checkOutput() does without --force.
/// @param path    name of the output
/// @param target  the file behind it
/// @throws Error io, usage
void checkReplaceable(const std::string& path, const std::string& target, OutputFormat format);

/// Checks that an output is no other output of the run so far, and no input unless --force is given. For outputs whose names are
/// known only when the work has begun; checkOutput() does so for the others.
/// @param others  outputs of tool.outputPaths() to compare with, from the first on
/// @throws Error usage
void checkApart(const Tool& tool, const std::string& path, std::size_t others);

/// Mix-in: `-o OUTPUT` (required), written atomically and checked by checkOutput().
///
/// With the input of a set, the output is a pattern, too: one file for each tile of the input.
class OutputFile {
 public:
  OutputFile(Tool& tool, OutputFormat format, const std::string& help, const std::string& name = "-o,--output");
  /// @param input  declared before; lives as long as the output
  OutputFile(Tool& tool, OutputFormat format, const std::string& help, const InputFile& input);
  const std::string& path() const { return path_; }
  /// Options for writeAsset. It may replace any file, because the check before the work has decided.
  /// @param udim  tile that the asset covers
  formats::WriteOptions writeOptions(const std::optional<formats::UdimPlace>& udim = {}) const {
    return {.overwrite = true, .udim = udim};
  }

 private:
  void check(Tool& tool, OutputFormat format, const std::vector<int>& tiles) const;

  std::string path_;
};

/// Replaces a file by this text, as formats::writeFile does.
/// @throws Error io
void writeTextFile(const std::string& path, const std::string& text);

/// Whether a text has the form that makeDepfile() writes.
bool isDepfile(std::string_view text);

/// Reads a whole file.
/// @throws Error io
std::vector<std::byte> readFile(const std::string& path);

/// A Make rule "targets: prerequisites", then an empty rule for each prerequisite so that deleting one is no error (as gcc
/// -MP). Blanks, '#', ':', '$' and, in targets, '%' are escaped so that Make and ninja read the same names.
/// @throws Error usage if a name holds what Make cannot express: line breaks, tabs, ';', '|' and '='; a backslash, '&' or
///         parentheses at its end; a backslash before '#', ':' or '%'
std::string makeDepfile(const std::vector<std::string>& targets, const std::vector<std::string>& prerequisites);

/// Throws Error io unless the path is a regular file (or pipe) that can be read.
void checkReadable(const std::string& path);

/// Throws Error io unless the path is a file that can be read, and more than once: no pipe and no device.
void checkRegular(const std::string& path);

}  // namespace glint::apps
