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
#include <string_view>

namespace glint::apps {
namespace {

namespace fs = std::filesystem;
using namespace std::literals;

constexpr std::size_t kReadChunk = std::size_t{1} << 20;

[[noreturn]] void throwIo(const std::string& rule, const std::string& path, const std::string& what, std::string remedy = {}) {
  throw Error(ErrorCode::io, rule, path, "", what, std::move(remedy));
}

std::string systemError() { return std::strerror(errno); }

/// Closes a file descriptor at the end of its scope.
class Descriptor {
 public:
  explicit Descriptor(int fd) : fd_(fd) {}
  ~Descriptor() {
    if (fd_ >= 0) ::close(fd_);
  }
  Descriptor(const Descriptor&) = delete;
  Descriptor& operator=(const Descriptor&) = delete;
  int get() const { return fd_; }
  int release() { return std::exchange(fd_, -1); }

 private:
  int fd_;
};

/// Calls `take` with successive pieces of a file.
template <class Take>
void readPieces(const std::string& path, const Take& take) {
  const Descriptor file(::open(path.c_str(), O_RDONLY | O_CLOEXEC));
  if (file.get() < 0) throwIo("file.readable", path, systemError());
  std::vector<std::byte> piece(kReadChunk);
  while (true) {
    const ssize_t count = ::read(file.get(), piece.data(), piece.size());
    if (count < 0 && errno == EINTR) continue;
    if (count < 0) throwIo("file.readable", path, systemError());
    if (count == 0) return;
    take(std::span<const std::byte>(piece.data(), static_cast<std::size_t>(count)));
  }
}

fs::path folderOf(const std::string& path) {
  const fs::path folder = fs::path(path).parent_path();
  return folder.empty() ? fs::path(".") : folder;
}

/// Whether the first bytes of a file show a format that the output may replace.
bool mayReplace(const std::string& path, OutputFormat format) {
  std::string head;
  readPieces(path, [&](std::span<const std::byte> piece) {
    if (head.empty()) head.assign(reinterpret_cast<const char*>(piece.data()), std::min<std::size_t>(piece.size(), 4096));
  });
  if (head.empty()) return true;
  if (format == OutputFormat::text) return head.find('\0') == std::string::npos;
  const std::string_view start = head;
  if (format == OutputFormat::asset) return start.starts_with("\x89HDF\r\n\x1a\n"sv);
  static constexpr std::array kImages = {"\x89PNG"sv, "\x76\x2f\x31\x01"sv, "II*\0"sv, "MM\0*"sv, "#?RADIANCE"sv, "PF\n"sv,
                                         "Pf\n"sv,    "\xff\xd8\xff"sv};
  return std::any_of(kImages.begin(), kImages.end(), [&](std::string_view magic) { return start.starts_with(magic); });
}

void checkOutput(const Tool& tool, const std::string& path, OutputFormat format) {
  checkWritable(path);
  struct stat existing {};
  if (::stat(path.c_str(), &existing) != 0) return;
  if (S_ISDIR(existing.st_mode)) throwIo("output.regular", path, "is a folder", "name a file in it");
  if (!S_ISREG(existing.st_mode)) throwIo("output.regular", path, "is not a regular file", "name a regular file with -o");
  if (tool.force()) return;
  for (const std::string& input : tool.inputPaths()) {
    struct stat other {};
    if (::stat(input.c_str(), &other) == 0 && other.st_dev == existing.st_dev && other.st_ino == existing.st_ino) {
      throw Error(ErrorCode::usage, "output.not_input", path, "", "the output is one of the inputs",
                  "name another file with -o, or replace the input with --force");
    }
  }
  if (!mayReplace(path, format)) {
    throw Error(ErrorCode::usage, "output.ours", path, "", "exists and is not a file of the kind that would replace it",
                "name another file with -o, or replace it with --force");
  }
}

void writeAll(int fd, std::span<const std::byte> bytes, const std::string& path) {
  while (!bytes.empty()) {
    const ssize_t count = ::write(fd, bytes.data(), bytes.size());
    if (count < 0 && errno == EINTR) continue;
    if (count < 0) throwIo("file.writable", path, systemError());
    bytes = bytes.subspan(static_cast<std::size_t>(count));
  }
}

/// Makes a directory entry permanent. Some file systems cannot sync a folder, which is no reason to fail.
void syncFolder(const fs::path& folder) {
  const Descriptor handle(::open(folder.c_str(), O_RDONLY | O_DIRECTORY | O_CLOEXEC));
  if (handle.get() >= 0) ::fsync(handle.get());
}

std::string escapeForMake(const std::string& name) {
  std::string escaped;
  for (const char c : name) {
    if (c == '\n' || c == '\r') {
      throw Error(ErrorCode::usage, "depfile.name", name, "", "a name with a line break cannot stand in a depfile",
                  "rename the file or leave out --depfile");
    }
    if (c == ' ' || c == '\t' || c == '#' || c == '%' || c == ':') escaped += '\\';
    if (c == '$') escaped += '$';
    escaped += c;
  }
  return escaped;
}

}  // namespace

InputFile::InputFile(Tool& tool, const std::string& help, const std::string& name) {
  tool.option(name, path_, help).required().unrecorded();
  tool.addCheck([this, &tool] {
    checkRegular(path_);
    tool.addInput(path_);
  });
}

InputFiles::InputFiles(Tool& tool, const std::string& help, const std::string& name) {
  tool.parser().add_option(name, paths_, help)->required()->expected(1, CLI::detail::expected_max_vector_size);
  tool.addCheck([this, &tool] {
    for (const std::string& path : paths_) {
      checkRegular(path);
      tool.addInput(path);
    }
  });
}

OutputFile::OutputFile(Tool& tool, OutputFormat format, const std::string& help, const std::string& name) {
  tool.option(name, path_, help).required().unrecorded();
  tool.addCheck([this, &tool, format] {
    checkOutput(tool, path_, format);
    tool.addOutput(path_);
  });
}

std::vector<std::byte> readFile(const std::string& path) {
  std::vector<std::byte> bytes;
  readPieces(path, [&](std::span<const std::byte> piece) { bytes.insert(bytes.end(), piece.begin(), piece.end()); });
  return bytes;
}

void writeFileAtomically(const std::string& path, std::span<const std::byte> bytes) {
  // Writing through a symbolic link replaces what it points to, as opening it would.
  std::error_code ignored;
  const fs::path target = fs::is_symlink(path, ignored) ? fs::weakly_canonical(path) : fs::path(path);
  const fs::path folder = folderOf(target.string());
  std::string temporary = (folder / ("." + target.filename().string() + ".XXXXXX")).string();
  Descriptor file(::mkostemp(temporary.data(), O_CLOEXEC));
  if (file.get() < 0) throwIo("file.writable", path, systemError(), "check that its folder can be written");
  try {
    writeAll(file.get(), bytes, path);
    const mode_t mask = ::umask(0);
    ::umask(mask);
    ::fchmod(file.get(), 0666 & ~mask);  // mkostemp makes files that only the owner can read
    if (::fsync(file.get()) != 0 || ::close(file.release()) != 0) throwIo("file.writable", path, systemError());
    if (::rename(temporary.c_str(), target.c_str()) != 0) throwIo("file.writable", path, systemError());
  } catch (...) {
    ::unlink(temporary.c_str());
    throw;
  }
  syncFolder(folder);
}

void writeFileAtomically(const std::string& path, const std::string& text) {
  writeFileAtomically(path, std::as_bytes(std::span(text.data(), text.size())));
}

std::string makeDepfile(const std::vector<std::string>& targets, const std::vector<std::string>& prerequisites) {
  std::string text;
  for (const std::string& target : targets) text += (text.empty() ? "" : " ") + escapeForMake(target);
  text += ":";
  for (const std::string& prerequisite : prerequisites) text += " \\\n  " + escapeForMake(prerequisite);
  text += "\n";
  for (const std::string& prerequisite : prerequisites) text += "\n" + escapeForMake(prerequisite) + ":\n";
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

void checkWritable(const std::string& path) {
  if (path.empty()) throw Error(ErrorCode::usage, "output.name", "", "", "the name of the output is empty", "name a file");
  const fs::path folder = folderOf(path);
  struct stat info {};
  if (::stat(folder.c_str(), &info) != 0 || !S_ISDIR(info.st_mode)) {
    throwIo("output.folder", path, "there is no folder " + folder.string(), "make it with mkdir -p " + folder.string());
  }
  if (::access(folder.c_str(), W_OK | X_OK) != 0) {
    throwIo("output.folder", path, "the folder " + folder.string() + " cannot be written: " + systemError(),
            "check its permissions or name another folder");
  }
}

}  // namespace glint::apps
