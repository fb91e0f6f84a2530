#include "manifest/json_lines.h"

#include <fcntl.h>
#include <sys/stat.h>
#include <unistd.h>

#include <algorithm>
#include <cerrno>
#include <nlohmann/json.hpp>
#include <string_view>

#include "glint/formats/descriptor.h"
#include "glint/formats/system_error.h"
#include "glint/model/json_depth.h"

namespace glint::apps {
namespace {

using formats::Descriptor;
using formats::throwUnreadable;
using formats::throwUnwritable;
using Json = nlohmann::ordered_json;

std::uint64_t sizeOf(int file, const std::string& path) {
  struct stat info {};
  if (::fstat(file, &info) != 0) throwUnreadable(path, "cannot be read", errno);
  return static_cast<std::uint64_t>(info.st_size);
}

/// Waits for the lock of the whole file, which goes with the descriptor. Where the file system has no locks, goes on without.
void lock(int file) {
  struct flock whole = {};
  whole.l_type = F_WRLCK;
  whole.l_whence = SEEK_SET;
  while (::fcntl(file, F_OFD_SETLKW, &whole) != 0 && errno == EINTR) {
  }
}

bool endsInsideLine(int file, std::uint64_t size) {
  char last = '\n';
  return size > 0 && ::pread(file, &last, 1, static_cast<off_t>(size - 1)) == 1 && last != '\n';
}

/// Adds bytes at the end, all or none.
void appendAll(int file, std::uint64_t size, std::string_view bytes, const std::string& path) {
  while (!bytes.empty()) {
    const ssize_t written = ::write(file, bytes.data(), bytes.size());
    if (written < 0 && errno == EINTR) continue;
    if (written <= 0) {
      const int error = written < 0 ? errno : EIO;
      if (::ftruncate(file, static_cast<off_t>(size)) != 0) throwUnwritable(path, "cannot be written, nor made shorter", error);
      throwUnwritable(path, "cannot be written", error);
    }
    bytes.remove_prefix(static_cast<std::size_t>(written));
  }
}

std::string readFrom(int file, std::uint64_t begin, std::uint64_t end, const std::string& path) {
  std::string text(end - begin, '\0');
  for (std::size_t done = 0; done < text.size();) {
    const ssize_t count = ::pread(file, text.data() + done, text.size() - done, static_cast<off_t>(begin + done));
    if (count < 0 && errno == EINTR) continue;
    if (count < 0) throwUnreadable(path, "cannot be read", errno);
    if (count == 0) text.resize(done);  // it became shorter meanwhile
    done += static_cast<std::size_t>(count);
  }
  return text;
}

}  // namespace

void JsonLines::append(const std::vector<Json>& lines) const {
  if (lines.empty()) return;
  const Descriptor file(::open(path_.c_str(), O_RDWR | O_APPEND | O_CREAT | O_CLOEXEC, 0666));
  if (file.id < 0) throwUnwritable(path_, "cannot be opened", errno);
  lock(file.id);
  const std::uint64_t size = sizeOf(file.id, path_);
  std::string text = endsInsideLine(file.id, size) ? "\n" : "";
  for (const Json& line : lines) text += line.dump(-1, ' ', false, Json::error_handler_t::replace) + "\n";
  appendAll(file.id, size, text, path_);
}

std::vector<Json> JsonLines::readNew() {
  const Descriptor file(::open(path_.c_str(), O_RDONLY | O_CLOEXEC));
  if (file.id < 0 && errno == ENOENT) return {};
  if (file.id < 0) throwUnreadable(path_, "cannot be opened", errno);
  const std::uint64_t size = sizeOf(file.id, path_);
  if (size < read_bytes_) read_bytes_ = 0;  // another file has taken its name
  const std::string text = readFrom(file.id, read_bytes_, size, path_);
  std::vector<Json> lines;
  std::size_t begin = 0;
  for (std::size_t end; (end = text.find('\n', begin)) != std::string::npos; begin = end + 1) {
    const std::string_view one = std::string_view(text).substr(begin, end - begin);
    if (jsonDepth(one) > kMostJsonDepth) continue;
    Json line = Json::parse(one, nullptr, false);
    if (line.is_object()) lines.push_back(std::move(line));
  }
  read_bytes_ += begin;
  return lines;
}

}  // namespace glint::apps
