#include "common/signals.h"

#include <errno.h>
#include <unistd.h>

#include <atomic>
#include <cstring>
#include <exception>
#include <new>

#include "glint/formats/atomic_file.h"
#include "glint/model/error.h"

namespace glint::apps {
namespace {

bool pipe_ended_process = false;
std::atomic<bool> memory_ran_out = false;

void endBy(int signal) {
  formats::removeTemporaryFiles();
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

/// Writes a message without taking memory, and ends the process.
[[noreturn]] void endUncaught(const char* what, const char* remedy) noexcept {
  formats::removeTemporaryFiles();
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
  memory_ran_out = true;
  throw std::bad_alloc();
}

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

bool memoryRanOut() { return memory_ran_out; }

void endByBrokenPipe() {
  if (pipe_ended_process) endBy(SIGPIPE);
}

}  // namespace glint::apps
