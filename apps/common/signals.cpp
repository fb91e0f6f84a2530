#include "common/signals.h"

#include <errno.h>
#include <poll.h>
#include <unistd.h>

#include <atomic>
#include <cstring>
#include <exception>
#include <new>
#include <stdexcept>

#include "glint/formats/atomic_file.h"
#include "glint/model/error.h"

namespace glint::apps {
namespace {

bool pipe_ended_process = false;
std::atomic<bool> memory_ran_out = false;
thread_local bool may_fail = false;                                   // in an allocation with std::nothrow
std::array<std::atomic<pid_t>, kMostChildren> running_children = {};  // 0: a free slot
static_assert(std::atomic<pid_t>::is_always_lock_free, "a handler of signals reads it");
std::atomic<int> stop_signal = 0;
static_assert(std::atomic<int>::is_always_lock_free, "a handler of signals sets it");

std::atomic<int> children_without_slot = 0;  // being started
static_assert(std::atomic<int>::is_always_lock_free, "a handler of signals reads it");

using CleanFn = void (*)() noexcept;
std::atomic<CleanFn> clean_at_end = nullptr;
static_assert(std::atomic<CleanFn>::is_always_lock_free, "a handler of signals reads it");

/// Removes what the process has not finished.
void cleanUp() noexcept {
  if (const CleanFn clean = clean_at_end) clean();
  formats::removeTemporaryFiles();
}

void endChildren() {
  // By other threads only: who starts a child holds signals back. Starting takes milliseconds.
  constexpr int kMostWait_ms = 1000;
  for (int k = 0; k < kMostWait_ms && children_without_slot > 0; ++k) ::poll(nullptr, 0, 1);
  for (const std::atomic<pid_t>& child : running_children)
    if (const pid_t process = child; process > 0) ::kill(process, SIGTERM);
}

void endBy(int signal) {
  int none = 0;
  stop_signal.compare_exchange_strong(none, signal);  // other threads start no more children
  endChildren();
  cleanUp();
  struct sigaction fatal = {};
  fatal.sa_handler = SIG_DFL;
  ::sigaction(signal, &fatal, nullptr);
  sigset_t set;
  ::sigemptyset(&set);
  ::sigaddset(&set, signal);
  ::pthread_sigmask(SIG_UNBLOCK, &set, nullptr);
  ::raise(signal);
  ::_exit(128 + signal);  // the first process of a container does not end by a signal
}

void stopBy(int signal) {
  int none = 0;
  if (!stop_signal.compare_exchange_strong(none, signal)) endBy(signal);
  const int error = errno;
  endChildren();
  errno = error;
}

/// Writes a message without taking memory, and ends the process.
[[noreturn]] void endUncaught(const char* what, const char* remedy) noexcept {
  cleanUp();
  const char* const name = ::program_invocation_short_name;
  for (const char* part : {name, ": error: ", what, "; ", remedy, "\n"}) {
    if (::write(STDERR_FILENO, part, std::strlen(part)) < 0) break;
  }
  ::_exit(static_cast<int>(ErrorCode::failed));
}

/// Exceptions that nobody catches: of what runs before Tool::run() or after it, of functions that must not throw, of threads of
/// libraries.
[[noreturn]] void onTerminate() noexcept {
  if (memory_ran_out) endUncaught("out of memory", kMemoryRemedy);
  try {
    if (const std::exception_ptr current = std::current_exception()) std::rethrow_exception(current);
  } catch (const std::bad_alloc&) {
    endUncaught("out of memory", kMemoryRemedy);
  } catch (const std::exception& error) {
    endUncaught(error.what(), "please report this as a defect");
  } catch (...) {
  }
  endUncaught("the program ended without a reason", "please report this as a defect");
}

/// Libraries may catch std::bad_alloc and give another reason.
[[noreturn]] void onNoMemory() {
  if (!may_fail) memory_ran_out = true;
  throw std::bad_alloc();
}

/// While a child is started, signals that end the process wait in this thread, and their handlers wait in others.
class HeldSignals {
 public:
  HeldSignals() {
    ++children_without_slot;
    sigset_t ending;
    ::sigemptyset(&ending);
    for (const int signal : {SIGINT, SIGTERM, SIGHUP, SIGQUIT}) ::sigaddset(&ending, signal);
    ::pthread_sigmask(SIG_BLOCK, &ending, &mask_);
  }
  ~HeldSignals() {
    --children_without_slot;
    ::pthread_sigmask(SIG_SETMASK, &mask_, nullptr);
  }
  HeldSignals(const HeldSignals&) = delete;
  HeldSignals& operator=(const HeldSignals&) = delete;
  /// The mask before.
  const sigset_t& mask() const { return mask_; }

 private:
  sigset_t mask_ = {};
};

/// Set before main() takes memory.
[[maybe_unused]] const std::terminate_handler handler_before = std::set_terminate(onTerminate);
[[maybe_unused]] const std::new_handler new_handler_before = std::set_new_handler(onNoMemory);

}  // namespace

SignalScope::SignalScope() {
  for (std::size_t k = 0; k < kSignals.size(); ++k) {
    const int signal = kSignals[k];
    ::sigaction(signal, nullptr, &old_[k]);
    if (signal == SIGPIPE) pipe_ended_process = old_[k].sa_handler == SIG_DFL;
    if (old_[k].sa_handler != SIG_DFL) continue;
    struct sigaction action = {};
    action.sa_handler = signal == SIGXFSZ || signal == SIGPIPE ? SIG_IGN : endBy;
    ::sigaction(signal, &action, nullptr);
  }
}

SignalScope::~SignalScope() {
  for (std::size_t k = 0; k < kSignals.size(); ++k) ::sigaction(kSignals[k], &old_[k], nullptr);
  pipe_ended_process = false;
}

ChildScope::ChildScope(const std::function<pid_t(const sigset_t& mask)>& start) {
  const HeldSignals held;
  process_ = start(held.mask());
  for (; slot_ < running_children.size(); ++slot_) {
    pid_t none = 0;
    if (running_children[slot_].compare_exchange_strong(none, process_)) break;
  }
  if (slot_ == running_children.size()) throw std::logic_error("too many children");
  if (stop_signal != 0) ::kill(process_, SIGTERM);  // the signal came before this child was started
}

ChildScope::~ChildScope() { running_children[slot_] = 0; }

StopScope::StopScope() {
  stop_signal = 0;
  for (std::size_t k = 0; k < kSignals.size(); ++k) {
    ::sigaction(kSignals[k], nullptr, &old_[k]);
    if (old_[k].sa_handler == SIG_IGN) continue;
    struct sigaction action = {};
    action.sa_handler = stopBy;
    action.sa_flags = SA_RESTART;
    ::sigaction(kSignals[k], &action, nullptr);
  }
}

StopScope::~StopScope() {
  for (std::size_t k = 0; k < kSignals.size(); ++k) ::sigaction(kSignals[k], &old_[k], nullptr);
  stop_signal = 0;
}

EndScope::EndScope(void (*clean)() noexcept) { clean_at_end = clean; }
EndScope::~EndScope() { clean_at_end = nullptr; }

int StopScope::stopped() const { return stop_signal; }

void endBySignal(int signal) {
  endBy(signal);
  ::_exit(128 + signal);
}

bool memoryRanOut() { return memory_ran_out; }

void endByBrokenPipe() {
  if (pipe_ended_process) endBy(SIGPIPE);
}

}  // namespace glint::apps

// As the standard library has them, but the handler of failures knows that the caller goes on without the memory.

void* operator new(std::size_t size, const std::nothrow_t& /*unused*/) noexcept {
  glint::apps::may_fail = true;
  void* memory = nullptr;
  try {
    memory = ::operator new(size);
  } catch (const std::bad_alloc&) {
  }
  glint::apps::may_fail = false;
  return memory;
}

void* operator new[](std::size_t size, const std::nothrow_t& tag) noexcept { return ::operator new(size, tag); }
