#pragma once

#include <sys/types.h>

#include <array>
#include <csignal>
#include <cstddef>
#include <functional>

namespace glint::apps {

/// What a user can do when there is no memory left.
constexpr const char* kMemoryRemedy = "use a smaller map or lower resolution, or a machine with more memory";

/// Handles signals while a tool runs. The end of the scope restores the earlier handlers.
///
/// INT, TERM, HUP and QUIT remove the temporary files, then end the process in the usual way (a shell sees 128 + n). A signal that
/// was ignored before stays ignored (nohup). XFSZ and PIPE are ignored: the call that meets the limit or the broken pipe fails
/// instead, with a message.
class SignalScope {
 public:
  SignalScope();
  ~SignalScope();
  SignalScope(const SignalScope&) = delete;
  SignalScope& operator=(const SignalScope&) = delete;

 private:
  static constexpr std::array kSignals = {SIGINT, SIGTERM, SIGHUP, SIGQUIT, SIGXFSZ, SIGPIPE};
  std::array<struct sigaction, kSignals.size()> old_ = {};
};

/// A process that ends with this one: as long as the scope lives, a signal that ends this process is sent to it as TERM.
class ChildScope {
 public:
  /// @param start  starts a process that gets this mask of signals, and returns its number; nobody waits for the process before the
  ///               end of the scope. Signals that end this process are held back meanwhile: no process is missed.
  explicit ChildScope(const std::function<pid_t(const sigset_t& mask)>& start);
  ChildScope(const ChildScope&) = delete;
  ChildScope& operator=(const ChildScope&) = delete;
  ~ChildScope();
  pid_t process() const { return process_; }

 private:
  std::size_t slot_ = 0;
  pid_t process_ = 0;
};
/// Most processes that end with this one.
inline constexpr std::size_t kMostChildren = 256;

/// Within a SignalScope, makes INT, TERM, HUP and QUIT no end at once: the children get TERM, and the program, which asks stopped(),
/// finishes what it has begun and calls endBySignal(). A second signal ends it at once. One scope at a time.
class StopScope {
 public:
  StopScope();
  ~StopScope();
  StopScope(const StopScope&) = delete;
  StopScope& operator=(const StopScope&) = delete;
  /// The signal that came; 0: none.
  int stopped() const;

 private:
  static constexpr std::array kSignals = {SIGINT, SIGTERM, SIGHUP, SIGQUIT};
  std::array<struct sigaction, kSignals.size()> old_ = {};
};

/// As long as the scope lives, a signal that ends the process calls a function first, after its children got TERM. One scope at a
/// time.
class EndScope {
 public:
  /// @param clean  may be called at any time and from any thread, and calls nothing that POSIX does not allow in handlers
  explicit EndScope(void (*clean)() noexcept);
  EndScope(const EndScope&) = delete;
  EndScope& operator=(const EndScope&) = delete;
  ~EndScope();
};

/// Removes temporary files and ends the process by a signal: a shell sees 128 + n.
[[noreturn]] void endBySignal(int signal);

/// Whether an allocation of C++ has failed in this process, here or in a library. Allocations that may fail (std::nothrow) do not
/// count.
bool memoryRanOut();

/// Ends the process by SIGPIPE, without temporary files, if SIGPIPE ended it before the SignalScope; returns otherwise.
void endByBrokenPipe();

}  // namespace glint::apps
