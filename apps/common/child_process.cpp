#include "common/child_process.h"

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
#include <utility>

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
      throw Error(ErrorCode::failed, "process.start", "", "", std::string("no pipe can be made: ") + std::strerror(errno));
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

/// Largest resident memory of a process so far, bytes; 0 if the system does not say.
std::int64_t peakOf(pid_t process) {
  std::ifstream status("/proc/" + std::to_string(process) + "/status");
  for (std::string line; std::getline(status, line);)
    if (line.starts_with("VmHWM:")) return 1024 * std::strtoll(line.c_str() + 6, nullptr, 10);
  return 0;
}

/// Adds what a pipe holds to a text, of which the last part is kept.
/// @return false at its end
bool take(int file, std::string& text) {
  constexpr std::size_t kMost = 1 << 20;
  std::array<char, 4096> piece{};
  const ssize_t count = ::read(file, piece.data(), piece.size());
  if (count < 0 && errno == EINTR) return true;
  if (count <= 0) return false;
  text.append(piece.data(), static_cast<std::size_t>(count));
  if (text.size() > kMost) text.erase(0, text.size() - kMost);
  return true;
}

/// Largest resident memory of a process that has ended, bytes. Linux passes that of this process on to its children, so that what the
/// system says counts only if it is more than ours.
std::int64_t peakOf(const rusage& usage, std::int64_t seen) {
  rusage ours{};
  ::getrusage(RUSAGE_SELF, &ours);
  return usage.ru_maxrss > ours.ru_maxrss ? 1024 * std::int64_t{usage.ru_maxrss} : seen;
}

/// Reads what a process writes to two pipes, to the end of both. Looks at its memory now and then: a program that takes long is looked
/// at less often, because the system adds up its pages for each look.
void watch(pid_t process, std::array<std::pair<int, std::string*>, 2> pipes, std::int64_t& peak_bytes) {
  constexpr int kFewest_ms = 4, kMost_ms = 64, kLooks = 64;
  int looks = 0;
  while (pipes[0].first >= 0 || pipes[1].first >= 0) {
    peak_bytes = std::max(peak_bytes, peakOf(process));
    std::array<pollfd, 2> ready = {pollfd{pipes[0].first, POLLIN, 0}, pollfd{pipes[1].first, POLLIN, 0}};
    if (::poll(ready.data(), ready.size(), std::clamp(kFewest_ms * ++looks / kLooks, kFewest_ms, kMost_ms)) <= 0) continue;
    for (std::size_t k = 0; k < ready.size(); ++k)
      if (ready[k].revents != 0 && !take(pipes[k].first, *pipes[k].second)) pipes[k].first = -1;  // poll leaves it out
  }
}

std::string lastLine(std::string text) {
  while (!text.empty() && text.back() == '\n') text.pop_back();
  const std::size_t line = text.rfind('\n');
  return line == std::string::npos ? text : text.substr(line + 1);
}

/// The signals that a program holds back.
class SpawnAttributes {
 public:
  explicit SpawnAttributes(const sigset_t& mask) {
    posix_spawnattr_init(&attributes_);
    posix_spawnattr_setsigmask(&attributes_, &mask);
    posix_spawnattr_setflags(&attributes_, POSIX_SPAWN_SETSIGMASK);
  }
  SpawnAttributes(const SpawnAttributes&) = delete;
  SpawnAttributes& operator=(const SpawnAttributes&) = delete;
  ~SpawnAttributes() { posix_spawnattr_destroy(&attributes_); }
  const posix_spawnattr_t* get() const { return &attributes_; }

 private:
  posix_spawnattr_t attributes_;
};

/// What a program gets of this process.
class FileActions {
 public:
  FileActions(const Pipe& output, const Pipe& errors, const ChildOptions& options) {
    constexpr int kShared = STDERR_FILENO + 1;
    posix_spawn_file_actions_init(&actions_);
    posix_spawn_file_actions_addopen(&actions_, STDIN_FILENO, "/dev/null", O_RDONLY, 0);
    if (options.keep_output)
      posix_spawn_file_actions_adddup2(&actions_, output.write, STDOUT_FILENO);
    else
      posix_spawn_file_actions_addopen(&actions_, STDOUT_FILENO, "/dev/null", O_WRONLY, 0);
    posix_spawn_file_actions_adddup2(&actions_, errors.write, STDERR_FILENO);
    if (options.shared_file >= 0) posix_spawn_file_actions_adddup2(&actions_, options.shared_file, kShared);
    if (!options.folder.empty()) posix_spawn_file_actions_addchdir_np(&actions_, options.folder.c_str());
  }
  FileActions(const FileActions&) = delete;
  FileActions& operator=(const FileActions&) = delete;
  ~FileActions() { posix_spawn_file_actions_destroy(&actions_); }
  const posix_spawn_file_actions_t* get() const { return &actions_; }

 private:
  posix_spawn_file_actions_t actions_;
};

/// Starts a program.
/// @param words  its arguments, from its name on
/// @return its number. Throws Error (failed)
pid_t start(const std::string& program, const std::vector<std::string>& words, const FileActions& actions,
            const sigset_t& mask) {
  std::vector<char*> argv;
  for (const std::string& word : words) argv.push_back(const_cast<char*>(word.c_str()));
  argv.push_back(nullptr);
  const SpawnAttributes attributes(mask);
  pid_t child = 0;
  if (const int failure = ::posix_spawn(&child, program.c_str(), actions.get(), attributes.get(), argv.data(), environ);
      failure != 0) {
    throw Error(ErrorCode::failed, "process.start", program, "", std::string("cannot be started: ") + std::strerror(failure),
                "install the whole package: programs of one folder call each other");
  }
  return child;
}

double seconds(const timeval& t) { return static_cast<double>(t.tv_sec) + 1e-6 * static_cast<double>(t.tv_usec); }

}  // namespace

std::vector<std::string> childFlags(const Tool& tool) {
  std::vector<std::string> flags = {"--threads", std::to_string(tool.threads())};
  if (memoryLimit() > 0) flags.insert(flags.end(), {"--max-memory", std::to_string(memoryLimit())});
  if (tool.trust()) flags.emplace_back("--trust");
  return flags;
}

ChildRun runProgram(const std::vector<std::string>& words, const ChildOptions& options) {
  const std::string folder = std::filesystem::read_symlink("/proc/self/exe").parent_path().string();
  const std::string program = folder + "/" + words.front();
  Pipe output, errors;
  const auto begin = std::chrono::steady_clock::now();
  pid_t child = 0;
  ChildRun run;
  {
    const ChildScope ends_with_us(
        [&](const sigset_t& mask) { return start(program, words, FileActions(output, errors, options), mask); });
    child = ends_with_us.process();
    output.closeWrite(), errors.closeWrite();
    watch(child, {std::pair{output.read, &run.output}, std::pair{errors.read, &run.message}}, run.peak_bytes);
    siginfo_t ended{};  // still a process of ours: its number belongs to nobody else before the scope ends
    while (::waitid(P_PID, static_cast<id_t>(child), &ended, WEXITED | WNOWAIT) < 0 && errno == EINTR) {
    }
  }
  run.message = lastLine(std::move(run.message));
  int status = 0;
  rusage usage{};
  while (::wait4(child, &status, 0, &usage) < 0) {
    if (errno != EINTR)
      throw Error(ErrorCode::failed, "process.start", program, "",
                  std::string("cannot be waited for: ") + std::strerror(errno));
  }
  run.wall_s = std::chrono::duration<double>(std::chrono::steady_clock::now() - begin).count();
  run.exit_code = WIFSIGNALED(status) ? 128 + WTERMSIG(status) : WEXITSTATUS(status);
  run.peak_bytes = peakOf(usage, run.peak_bytes);
  run.cpu_s = seconds(usage.ru_utime) + seconds(usage.ru_stime);
  return run;
}

}  // namespace glint::apps
