#include "common/standard_streams.h"

#include <fcntl.h>
#include <unistd.h>

#include <cerrno>
#include <cstdio>
#include <cstring>

#include "common/signals.h"
#include "glint/model/error.h"

namespace glint::apps {
namespace {

[[noreturn]] void throwStdout(int error) {
  if (error == EPIPE) endByBrokenPipe();
  throw Error(ErrorCode::io, "stdout", "", "", std::string("stdout cannot be written: ") + std::strerror(error),
              "check where it leads");
}

}  // namespace

void openStandardStreams() {
  // open() takes the lowest free number, which is that of the missing stream. Opened for the wrong direction, it cannot be used.
  for (const int stream : {STDIN_FILENO, STDOUT_FILENO, STDERR_FILENO}) {
    if (::fcntl(stream, F_GETFD) >= 0 || errno != EBADF) continue;
    if (::open("/dev/null", stream == STDIN_FILENO ? O_WRONLY : O_RDONLY) < 0) return;
  }
}

void writeStdout(const std::string& text) {
  // A failure loses the text in the stream's buffer, so the first failure counts.
  if (std::fwrite(text.data(), 1, text.size(), stdout) != text.size()) throwStdout(errno);
}

void flushStdout() {
  if (std::fflush(stdout) != 0) throwStdout(errno);
}

void writeStderr(const std::string& text) noexcept {
  std::fwrite(text.data(), 1, text.size(), stderr);
  std::fflush(stderr);
}

}  // namespace glint::apps
