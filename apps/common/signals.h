#pragma once

#include <array>
#include <csignal>

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

/// Whether an allocation of C++ has failed in this process, here or in a library.
bool memoryRanOut();

/// Ends the process by SIGPIPE, without temporary files, if SIGPIPE ended it before the SignalScope; returns otherwise.
void endByBrokenPipe();

}  // namespace glint::apps
