#include "glint/formats/system_error.h"

#include <cerrno>
#include <cstring>

#include "glint/model/error.h"

namespace glint::formats {

std::string remedyFor(int error) {
  switch (error) {
    case ENOSPC:
    case EDQUOT:
      return "free some space or write to another disk";
    case EFBIG:
      return "raise the limit of ulimit -f, or write to another disk";
    case EMFILE:
    case ENFILE:
      return "raise the limit of ulimit -n, or open fewer files at a time";
    case ENAMETOOLONG:
      return "give it a shorter name";
    case ELOOP:
      return "repair the symbolic links";
    case EIO:
      return "check the disk";
    case EPIPE:
      return "keep the reader of the pipe running";
    case ENOENT:
    case ENOTDIR:
      return "check the name, and make its folder";
    default:
      return "check the path and its permissions";
  }
}

void throwUnreadable(const std::filesystem::path& path, const std::string& what, int error) {
  throw Error(ErrorCode::io, "file.readable", path.string(), {}, what + ": " + std::strerror(error), remedyFor(error));
}

void throwUnwritable(const std::filesystem::path& path, const std::string& what, int error) {
  throw Error(ErrorCode::io, "file.writable", path.string(), {}, what + ": " + std::strerror(error), remedyFor(error));
}

}  // namespace glint::formats
