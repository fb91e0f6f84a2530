#include "glint/formats/file_pieces.h"

#include <fcntl.h>
#include <unistd.h>

#include <algorithm>
#include <cerrno>
#include <vector>

#include "glint/formats/descriptor.h"
#include "glint/formats/system_error.h"
#include "glint/model/error.h"

namespace glint::formats {

void readInPieces(const std::filesystem::path& path, std::uint64_t offset, std::uint64_t size_bytes, const ByteSink& sink) {
  constexpr std::uint64_t kPieceBytes = 1 << 20;
  const Descriptor file(::open(path.c_str(), O_RDONLY | O_CLOEXEC));
  if (file.id < 0) throwUnreadable(path, "cannot be read", errno);
  if (offset > 0 && ::lseek(file.id, static_cast<off_t>(offset), SEEK_SET) < 0) throwUnreadable(path, "cannot be read", errno);
  std::vector<std::byte> buffer(std::min(kPieceBytes, size_bytes));
  for (std::uint64_t left = size_bytes; left > 0;) {
    const ssize_t count = ::read(file.id, buffer.data(), std::min<std::uint64_t>(buffer.size(), left));
    if (count < 0 && errno == EINTR) continue;
    if (count < 0) throwUnreadable(path, "cannot be read", errno);
    if (count == 0 && size_bytes == kToTheEnd) return;
    if (count == 0) throw Error(ErrorCode::io, "file.readable", path.string(), {}, "became shorter while it was being read");
    sink(std::span(buffer).first(static_cast<std::size_t>(count)));
    left -= static_cast<std::uint64_t>(count);
  }
}

}  // namespace glint::formats
