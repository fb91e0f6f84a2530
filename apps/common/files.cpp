#include "common/files.h"

#include <fcntl.h>
#include <sys/stat.h>
#include <unistd.h>

#include <CLI/App.hpp>
#include <algorithm>
#include <array>
#include <cerrno>
#include <cstring>
#include <filesystem>
#include <fstream>
#include <string_view>

#include "common/answer_columns.h"
#include "glint/formats/atomic_file.h"
#include "glint/formats/descriptor.h"
#include "glint/formats/udim.h"

namespace glint::apps {
namespace {

namespace fs = std::filesystem;
using namespace std::literals;

constexpr std::size_t kReadChunk = std::size_t{1} << 20;

[[noreturn]] void throwIo(const std::string& rule, const std::string& path, const std::string& what, std::string remedy = {}) {
  throw Error(ErrorCode::io, rule, path, "", what, std::move(remedy));
}

std::string systemError() { return std::strerror(errno); }

/// Calls `take` with successive pieces of a file.
template <class Take>
void readPieces(const std::string& path, const Take& take) {
  const formats::Descriptor file(::open(path.c_str(), O_RDONLY | O_CLOEXEC));
  if (file.id < 0) throwIo("file.readable", path, systemError());
  std::vector<std::byte> piece(kReadChunk);
  while (true) {
    const ssize_t count = ::read(file.id, piece.data(), piece.size());
    if (count < 0 && errno == EINTR) continue;
    if (count < 0) throwIo("file.readable", path, systemError());
    if (count == 0) return;
    take(std::span<const std::byte>(piece.data(), static_cast<std::size_t>(count)));
  }
}

fs::path folderOf(const fs::path& path) {
  const fs::path folder = path.parent_path();
  return folder.empty() ? fs::path(".") : folder;
}

/// The first bytes of a file.
std::string headOf(const std::string& path, std::size_t most) {
  const formats::Descriptor file(::open(path.c_str(), O_RDONLY | O_CLOEXEC));
  if (file.id < 0) throwIo("file.readable", path, systemError());
  std::string head(most, '\0');
  std::size_t size = 0;
  while (size < most) {
    const ssize_t count = ::read(file.id, head.data() + size, most - size);
    if (count < 0 && errno == EINTR) continue;
    if (count < 0) throwIo("file.readable", path, systemError());
    if (count == 0) break;
    size += static_cast<std::size_t>(count);
  }
  head.resize(size);
  return head;
}

bool isImage(std::string_view start) {
  static constexpr std::array kImages = {"\x89PNG"sv, "\x76\x2f\x31\x01"sv, "II*\0"sv, "MM\0*"sv, "II+\0"sv,
                                         "MM\0+"sv,   "#?RADIANCE"sv,       "PF\n"sv,  "Pf\n"sv,  "P5\n"sv,
                                         "P6\n"sv,    "\xff\xd8\xff"sv,     "BM"sv,    "GIF8"sv,  "DDS "sv};
  const bool webp = start.starts_with("RIFF"sv) && start.substr(8).starts_with("WEBP"sv);
  return webp || std::any_of(kImages.begin(), kImages.end(), [&](std::string_view magic) { return start.starts_with(magic); });
}

/// Whether a file is an image of TGA, which only its end says.
bool isTga(const std::string& path) {
  constexpr std::string_view kSignature = "TRUEVISION-XFILE.\0"sv;
  std::ifstream file(path, std::ios::binary);
  std::string end(kSignature.size(), ' ');
  file.seekg(-static_cast<std::streamoff>(end.size()), std::ios::end);
  file.read(end.data(), static_cast<std::streamsize>(end.size()));
  return file.good() && end == kSignature;
}

/// A name as one word of a command, for people to paste.
std::string shellWord(const std::string& name) {
  constexpr std::string_view kPlain = "ABCDEFGHIJKLMNOPQRSTUVWXYZabcdefghijklmnopqrstuvwxyz0123456789._/+@-";
  const std::string word = name.starts_with('-') ? "./" + name : name;
  if (!word.empty() && word.find_first_not_of(kPlain) == std::string::npos) return word;
  std::string quoted = "'";
  for (const char c : word) quoted += c == '\'' ? "'\\''" : std::string(1, c);
  return quoted + "'";
}

/// Whether the first bytes of a file show that it is an earlier result of the same kind.
bool mayReplace(const std::string& path, OutputFormat format) {
  constexpr std::size_t kHeadBytes = 1 << 20;  // more than the root attributes, which come first
  const std::string head = headOf(path, kHeadBytes);
  if (head.empty()) return true;
  switch (format) {
    case OutputFormat::asset:
      return head.starts_with("\x89HDF\r\n\x1a\n"sv) && head.find("glint_format") != std::string::npos;
    case OutputFormat::image:
      return isImage(head) || isTga(path);
    case OutputFormat::table:
      return isAnswerHeader(std::string_view(head).substr(0, head.find('\n')));
    case OutputFormat::depfile:
      return isDepfile(head);
    case OutputFormat::results:
      return head.starts_with("{\"schema\":\"glint-bench results"sv);
    case OutputFormat::page:
      return head.starts_with("<!doctype html>"sv) && head.find("content=\"glint-bench\"") != std::string::npos;
    case OutputFormat::plan:
      return head.starts_with("{\n \"schema\": \"glint-plan plan"sv) || head.starts_with("{\n \"schema\": \"glint-plan jobs"sv);
    case OutputFormat::plan_rules:
      return head.starts_with("# Made by glint-plan"sv);
    case OutputFormat::manifest:
      return head.starts_with("{\n \"schema\": \"glint-farm manifest"sv);
    case OutputFormat::farm_log:
      return head.starts_with("{\"key\":"sv);
    case OutputFormat::test_report:
      return head.find("glint-validate"sv) != std::string::npos &&
             (head.starts_with("<?xml"sv) || head.starts_with("{\n \"$schema\""sv));
  }
  return false;
}

/// Whether two names lead to one file, which need not exist yet.
bool isSameFile(const std::string& a, const std::string& b) {
  struct stat one {
  }, other{};
  const bool has_one = ::stat(a.c_str(), &one) == 0, has_other = ::stat(b.c_str(), &other) == 0;
  if (has_one != has_other) return false;
  if (has_one) return one.st_dev == other.st_dev && one.st_ino == other.st_ino;
  const auto place = [](const std::string& path) { return fs::weakly_canonical(fs::absolute(formats::findOutput(path).path)); };
  return place(a) == place(b);
}

[[noreturn]] void refuseInDepfile(const std::string& name, const std::string& what) {
  throw Error(ErrorCode::usage, "depfile.name", name, "", "a name with " + what + " cannot stand in a depfile",
              "rename the file or leave out --depfile");
}

/// Refuses names that Make cannot express. After a backslash before a sign that is escaped, Make and ninja read different names.
void checkNameForMake(const std::string& name) {
  for (const auto& [sign, what] : {std::pair{'\n', "a line break"}, std::pair{'\r', "a line break"}, std::pair{'\t', "a tab"},
                                   std::pair{';', "';'"}, std::pair{'|', "'|'"}, std::pair{'=', "'='"}})
    if (name.find(sign) != std::string::npos) refuseInDepfile(name, what);
  for (const std::string_view pair : {"\\#"sv, "\\:"sv, "\\%"sv})
    if (name.find(pair) != std::string::npos) refuseInDepfile(name, "'" + std::string(pair) + "'");
  if (name.ends_with('\\') || name.ends_with('&')) refuseInDepfile(name, "'" + name.substr(name.size() - 1) + "' at its end");
  if (name.ends_with(')') && name.find('(') != std::string::npos) refuseInDepfile(name, "parentheses at its end");
}

/// Escapes a name for Make: blank, `#` and `:` get a backslash, `$` is doubled, and a `~` in front becomes `./~`. ninja reads the
/// same names. ninja up to 1.11 ends a name at & ' * ? < > " ` and ^, and knows no escape for them. The signs * ? and [ stay as
/// they are: Make takes them literally if no file matches, and an escaped sign would not match a file that was deleted.
std::string escapeForMake(const std::string& name) {
  checkNameForMake(name);
  std::string escaped = name.starts_with('~') ? "./" : "";
  for (std::size_t k = 0; k < name.size(); ++k) {
    const char c = name[k];
    if (c == ' ') {  // Make halves the backslashes before a blank
      for (std::size_t b = k; b > 0 && name[b - 1] == '\\'; --b) escaped += '\\';
    }
    if (c == ' ' || c == '#' || c == ':') escaped += '\\';
    if (c == '$') escaped += '$';
    escaped += c;
  }
  return escaped;
}

/// Escapes a target. `%` makes a pattern of a target; in a prerequisite it is an ordinary sign.
std::string escapeTarget(const std::string& name) {
  std::string escaped;
  for (const char c : escapeForMake(name)) escaped += c == '%' ? std::string("\\%") : std::string(1, c);
  return escaped;
}

}  // namespace

void refuseUdim(const std::string& path, const std::string& what) {
  throw Error(
      ErrorCode::unsupported, "udim.unsupported", path, "", what,
      "glint-ingest, glint-pyramid, glint-compress, glint-moments, glint-query, glint-info and glint-validate take UDIM "
      "sets; for others ingest the image of one tile by its own name");
}

void refuseTile(const Tool& tool, const std::string& path) {
  refuseUdim(path, "is a tile of a UDIM set, with margins of its neighbours, which " + tool.name() + " does not take");
}

std::vector<std::string> addInputs(Tool& tool, const std::string& path, UdimSets sets) {
  std::vector<std::string> files;
  if (!formats::isUdimPattern(path)) {
    files.push_back(path);
  } else if (sets == UdimSets::refused) {
    refuseUdim(path, "is a UDIM set, which " + tool.name() + " does not take");
  } else {
    for (const int tile : formats::udimTiles(path)) files.push_back(formats::udimFile(path, tile));
    for (const std::string& stray : formats::udimStrays(path))
      tool.warn((std::filesystem::path(path).parent_path() / stray).string() + ": is left out of " + path +
                ": the numbers of tiles are 1001 to 9999");
  }
  for (const std::string& file : files) {
    checkRegular(file);
    tool.addInput(file);
  }
  return files;
}

InputFile::InputFile(Tool& tool, const std::string& help, const std::string& name, UdimSets sets) {
  tool.option(name, path_, help).required().unrecorded();
  tool.addCheck([this, &tool, sets] {
    addInputs(tool, path_, sets);
    if (formats::isUdimPattern(path_)) tiles_ = formats::udimTiles(path_);
  });
}

InputFiles::InputFiles(Tool& tool, const std::string& help, const std::string& name, bool required, UdimSets sets) {
  CLI::Option* option = tool.parser().add_option(name, paths_, help);
  option->expected(required ? 1 : 0, CLI::detail::expected_max_vector_size)->required(required);
  tool.addCheck([this, &tool, sets] {
    std::vector<std::string> files;
    for (const std::string& path : paths_)
      for (const std::string& file : addInputs(tool, path, sets)) files.push_back(file);
    paths_ = files;
  });
}

OutputFile::OutputFile(Tool& tool, OutputFormat format, const std::string& help, const std::string& name) {
  tool.option(name, path_, help).required().unrecorded();
  tool.addCheck([this, &tool, format] { check(tool, format, {}); });
}

OutputFile::OutputFile(Tool& tool, OutputFormat format, const std::string& help, const InputFile& input) {
  tool.option("-o,--output", path_, help).required().unrecorded();
  tool.addCheck([this, &tool, format, &input] { check(tool, format, input.tiles()); });
}

namespace {

/// Warns of files of tiles that the set does not have any more: whoever opens the pattern would open them, too.
void warnOfOtherTiles(Tool& tool, const std::string& pattern, const std::vector<int>& tiles) {
  std::vector<int> there;
  try {
    there = formats::udimTiles(pattern);
  } catch (const Error&) {
    return;  // none is there yet; a folder that cannot be written is an error of its own
  }
  for (const int tile : there)
    if (!std::binary_search(tiles.begin(), tiles.end(), tile))
      tool.warn(formats::udimFile(pattern, tile).string() + ": is of a tile that the input has no file of: remove it");
}

}  // namespace

void OutputFile::check(Tool& tool, OutputFormat format, const std::vector<int>& tiles) const {
  const bool pattern = formats::isUdimPattern(path_);
  if (pattern != !tiles.empty())
    throw Error(ErrorCode::usage, "udim.output", path_, "",
                pattern ? "names a UDIM set, and the input is one file" : "names one file, and the input is a UDIM set",
                pattern ? "name one file" : "put <UDIM> into the name of the output, such as name.<UDIM>.glint");
  if (!pattern) {
    checkOutput(tool, path_, format);
    tool.addOutput(path_);
    return;
  }
  formats::checkUdimPattern(path_);
  warnOfOtherTiles(tool, path_, tiles);
  tool.makesMore();  // forEachMap skips tile by tile
  for (const int tile : tiles) {
    const std::string file = formats::udimFile(path_, tile);
    checkOutput(tool, file, format);
    tool.addOutput(file);
  }
}

std::vector<std::byte> readFile(const std::string& path) {
  std::vector<std::byte> bytes;
  readPieces(path, [&](std::span<const std::byte> piece) { bytes.insert(bytes.end(), piece.begin(), piece.end()); });
  return bytes;
}

void writeTextFile(const std::string& path, const std::string& text) {
  formats::writeFile(path, std::as_bytes(std::span(text)));
}

bool isDepfile(std::string_view text) {
  bool first = true;
  for (std::size_t begin = 0; begin < text.size(); first = false) {
    const std::size_t end = std::min(text.find('\n', begin), text.size());
    const std::string_view line = text.substr(begin, end - begin);
    begin = end + 1;
    const bool starts_rule = line.ends_with(":") || line.ends_with(": \\");
    const bool prerequisite = line.starts_with("  ") && line.size() > 2;
    if (first ? !starts_rule : !starts_rule && !prerequisite && !line.empty()) return false;
    if (line.find('\0') != line.npos) return false;
  }
  return true;
}

std::string makeDepfile(const std::vector<std::string>& targets, const std::vector<std::string>& prerequisites) {
  std::string text;
  for (const std::string& target : targets) text += (text.empty() ? "" : " ") + escapeTarget(target);
  text += ":";
  for (const std::string& prerequisite : prerequisites) text += " \\\n  " + escapeForMake(prerequisite);
  text += "\n";
  // ninja refuses a target with `\%` as an output that nobody declared. So prerequisites with `%` have rules only if an output has
  // a `%` itself: such a depfile is for Make.
  const auto holdsPercent = [](const std::string& name) { return name.find('%') != std::string::npos; };
  const bool for_make = std::any_of(targets.begin(), targets.end(), holdsPercent);
  for (const std::string& prerequisite : prerequisites)
    if (for_make || !holdsPercent(prerequisite)) text += "\n" + escapeTarget(prerequisite) + ":\n";
  return text;
}

void checkRegular(const std::string& path) {
  checkReadable(path);
  struct stat info {};
  if (::stat(path.c_str(), &info) != 0 || S_ISREG(info.st_mode)) return;
  const char* what = S_ISFIFO(info.st_mode) || S_ISSOCK(info.st_mode) ? "is a pipe, not a file" : "is a device, not a file";
  throwIo("input.regular", path, what, "write what it carries to a file and name this: it is read more than once");
}

void checkReadable(const std::string& path) {
  struct stat info {};
  if (::stat(path.c_str(), &info) != 0) throwIo("input.exists", path, systemError(), "check the name of the input");
  if (S_ISDIR(info.st_mode)) throwIo("input.regular", path, "is a folder", "name a file in it");
  if (::access(path.c_str(), R_OK) != 0) throwIo("file.readable", path, systemError(), "check its permissions");
}

void checkApart(const Tool& tool, const std::string& path, std::size_t others) {
  if (formats::findOutput(path).kind == formats::OutputTarget::Kind::stream) return;
  const std::vector<std::string> inputs = tool.readPaths();
  const bool is_input =
      std::any_of(inputs.begin(), inputs.end(), [&](const std::string& input) { return isSameFile(path, input); });
  if (is_input && !tool.force()) {
    throw Error(ErrorCode::usage, "output.not_input", path, "", "the output is one of the inputs",
                "name another file, or replace the input with --force");
  }
  for (std::size_t k = 0; k < others; ++k) {
    if (isSameFile(path, tool.outputPaths()[k]))
      throw Error(ErrorCode::usage, "output.apart", path, "", "two outputs have this name",
                  "name another file for one of them");
  }
}

void checkReplaceable(const std::string& path, const std::string& target, OutputFormat format) {
  struct stat existing {};
  if (::stat(target.c_str(), &existing) != 0) throwIo("output.regular", path, systemError());
  // A mode of 0444 is a decision of the owner, which holds for root too.
  constexpr mode_t kAnyWrite = S_IWUSR | S_IWGRP | S_IWOTH;
  if ((existing.st_mode & kAnyWrite) == 0 || ::access(target.c_str(), W_OK) != 0)
    throwIo("output.read_only", path, "exists and is read-only", "name another file, or replace it with --force");
  if (!mayReplace(target, format)) {
    throw Error(ErrorCode::usage, "output.ours", path, "", "exists and is not a file of the kind that would replace it",
                "name another file, or replace it with --force");
  }
}

void checkOutput(Tool& tool, const std::string& path, OutputFormat format) {
  if (path.empty()) throw Error(ErrorCode::usage, "output.name", "", "", "the name of the output is empty", "name a file");
  if (path == "-")
    throw Error(ErrorCode::usage, "output.stdout", path, "", "only tables are written to stdout",
                "name a file; ./- is one of this name");
  const formats::OutputTarget target = formats::findOutput(path);
  tool.addLateCheck([&tool, path, others = tool.outputPaths().size()] { checkApart(tool, path, others); });
  if (target.kind == formats::OutputTarget::Kind::stream) {
    if (target.descriptor < 0 && ::access(target.path.c_str(), W_OK) != 0)
      throwIo("file.writable", path, systemError(), "check its permissions");
    return;
  }
  const fs::path folder = folderOf(target.path);
  struct stat info {};
  if (::stat(folder.c_str(), &info) != 0 || !S_ISDIR(info.st_mode)) {
    throwIo("output.folder", path, "there is no folder " + folder.string(),
            "make it with mkdir -p " + shellWord(folder.string()));
  }
  if (::access(folder.c_str(), W_OK | X_OK) != 0) {
    throwIo("output.folder", path, "the folder " + folder.string() + " cannot be written: " + systemError(),
            "check its permissions or name another folder");
  }
  if (target.kind != formats::OutputTarget::Kind::file || tool.force()) return;
  const auto check = [path, file = std::string(target.path), format] { checkReplaceable(path, file, format); };
  if (tool.skipUnchanged() && format == OutputFormat::asset)
    tool.addReplaceCheck(check);
  else
    check();
}

}  // namespace glint::apps
