#include "common/signals.h"

#include "glint/formats/atomic_file.h"

namespace glint::apps {
namespace {

bool pipe_ended_process = false;

void endBy(int signal) {
  formats::removeTemporaryFiles();
  struct sigaction fatal = {};
  fatal.sa_handler = SIG_DFL;
  ::sigaction(signal, &fatal, nullptr);
  ::raise(signal);  // in a handler it waits until the handler returns
}

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

void endByBrokenPipe() {
  if (pipe_ended_process) endBy(SIGPIPE);
}

}  // namespace glint::apps
