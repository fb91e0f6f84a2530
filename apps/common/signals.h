#pragma once

#include <array>
#include <csignal>

namespace glint::apps {

/// What signals do while a tool runs; the old ways come back at the end of the scope.
///
/// INT, TERM, HUP and QUIT remove the temporary files and then end the process as they would have (a shell sees 128 + n),
/// unless they were ignored before (nohup). XFSZ and PIPE are ignored: the call that meets the limit or the broken pipe fails
/// and says so.
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

/// Ends the process by SIGPIPE, without temporary files, if SIGPIPE ended it before the SignalScope; returns otherwise.
void endByBrokenPipe();

}  // namespace glint::apps
