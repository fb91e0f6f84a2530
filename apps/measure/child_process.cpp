#include "measure/child_process.h"

#include <fcntl.h>
#include <poll.h>
#include <spawn.h>
#include <sys/resource.h>
#include <sys/wait.h>
#include <unistd.h>

#include <algorithm>
#include <array>
#include <cerrno>
#include <chrono>
#include <cstdlib>
#include <cstring>
#include <filesystem>
#include <fstream>

#include "common/memory.h"
#include "common/signals.h"
#include "glint/model/error.h"

extern char** environ;

namespace glint::apps {
namespace {

/// The two ends of a pipe, closed at the end of the scope.
struct Pipe {
  int read = -1, write = -1;
  Pipe() {
    std::array<int, 2> ends{};
    if (::pipe2(ends.data(), O_CLOEXEC) != 0)
      throw Error(ErrorCode::failed, "bench.process", "", "", std::string("no pipe can be made: ") + std::strerror(errno));
    read = ends[0], write = ends[1];
  }
  Pipe(const Pipe&) = delete;
  Pipe& operator=(const Pipe&) = delete;
  ~Pipe() {
    closeWrite();
    ::close(read);
  }
  void closeWrite() {
    if (write >= 0) ::close(write);
    write = -1;
  }
};

/// Largest resident memory of a process so far, bytes; 0 if the system does not say. Not ru_maxrss: Linux passes that of this
/// process on to its children.
std::int64_t peakOf(pid_t process) {
  std::ifstream status("/proc/" + std::to_string(process) + "/status");
  for (std::string line; std::getline(status, line);)
    if (line.starts_with("VmHWM:")) return 1024 * std::strtoll(line.c_str() + 6, nullptr, 10);
  return 0;
}

/// Reads what a process writes to a pipe, to the end. Looks at its memory now and then.
/// @return the last line
std::string watch(pid_t process, int file, std::int64_t& peak_bytes) {
  constexpr int kBetweenLooks_ms = 4;
  std::string text;
  std::array<char, 4096> piece{};
  for (;;) {
    peak_bytes = std::max(peak_bytes, peakOf(process));
    pollfd ready = {file, POLLIN, 0};
    if (::poll(&ready, 1, kBetweenLooks_ms) <= 0) continue;
    const ssize_t count = ::read(file, piece.data(), piece.size());
    if (count < 0 && errno == EINTR) continue;
    if (count <= 0) break;
    text.append(piece.data(), static_cast<std::size_t>(count));
    constexpr std::size_t kMost = 1 << 16;
    if (text.size() > kMost) text.erase(0, text.size() - kMost);
  }
  while (!text.empty() && text.back() == '\n') text.pop_back();
  const std::size_t line = text.rfind('\n');
  return line == std::string::npos ? text : text.substr(line + 1);
}

double seconds(const timeval& t) { return static_cast<double>(t.tv_sec) + 1e-6 * static_cast<double>(t.tv_usec); }

}  // namespace

std::vector<std::string> childFlags(const Tool& tool) {
  std::vector<std::string> flags = {"--threads", std::to_string(tool.threads())};
  if (memoryLimit() > 0) flags.insert(flags.end(), {"--max-memory", std::to_string(memoryLimit())});
  if (tool.trust()) flags.emplace_back("--trust");
  return flags;
}

ChildRun runProgram(const std::vector<std::string>& words) {
  const std::string folder = std::filesystem::read_symlink("/proc/self/exe").parent_path().string();
  const std::string program = folder + "/" + words.front();
  std::vector<char*> argv;
  for (const std::string& word : words) argv.push_back(const_cast<char*>(word.c_str()));
  argv.push_back(nullptr);
  Pipe errors;
  posix_spawn_file_actions_t actions;
  posix_spawn_file_actions_init(&actions);
  posix_spawn_file_actions_addopen(&actions, STDIN_FILENO, "/dev/null", O_RDONLY, 0);
  posix_spawn_file_actions_addopen(&actions, STDOUT_FILENO, "/dev/null", O_WRONLY, 0);
  posix_spawn_file_actions_adddup2(&actions, errors.write, STDERR_FILENO);
  const auto start = std::chrono::steady_clock::now();
  pid_t child = 0;
  const int failure = ::posix_spawn(&child, program.c_str(), &actions, nullptr, argv.data(), environ);
  posix_spawn_file_actions_destroy(&actions);
  if (failure != 0) {
    throw Error(ErrorCode::failed, "bench.process", program, "", std::string("cannot be started: ") + std::strerror(failure),
                "install the whole package: programs of one folder call each other");
  }
  setChild(child);
  errors.closeWrite();
  ChildRun run;
  run.message = watch(child, errors.read, run.peak_bytes);
  int status = 0;
  rusage usage{};
  while (::wait4(child, &status, 0, &usage) < 0) {
    if (errno != EINTR)
      throw Error(ErrorCode::failed, "bench.process", program, "",
                  std::string("cannot be waited for: ") + std::strerror(errno));
  }
  setChild(0);
  run.wall_s = std::chrono::duration<double>(std::chrono::steady_clock::now() - start).count();
  run.exit_code = WIFSIGNALED(status) ? 128 + WTERMSIG(status) : WEXITSTATUS(status);
  run.cpu_s = seconds(usage.ru_utime) + seconds(usage.ru_stime);
  return run;
}

}  // namespace glint::apps
