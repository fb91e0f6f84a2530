#pragma once

#include <cstdint>
#include <string>
#include <vector>

#include "common/tool.h"

namespace glint::apps {

/// A program that ran to its end.
struct ChildRun {
  int exit_code = 0;  ///< as a shell has it: 128 + n after signal n
  double wall_s = 0;
  double cpu_s = 0;
  std::int64_t peak_bytes = 0;  ///< largest resident memory; of programs that take less than this one, as often as one looks
  std::string message;          ///< last line that it wrote to stderr
  std::string output;           ///< what it wrote to stdout, if it was kept
};

/// How a program is run.
struct ChildOptions {
  bool keep_output = false;  ///< return what it writes to stdout
  std::string folder = {};   ///< folder in which it runs; empty: that of this process
  int shared_file = -1;      ///< open file that it gets too, so that a lock holds until both have ended; -1: none
};

/// The flags of this run that hold for programs that it starts: --threads, and --max-memory and --trust where they are given.
std::vector<std::string> childFlags(const Tool& tool);

/// Runs a program of this package, with nothing on stdin, and waits for it. A signal that ends this process ends the program, too.
/// @param words  name of the program, without folder, and its arguments
/// @throws Error failed if the program cannot be started
/// @note thread-safe
ChildRun runProgram(const std::vector<std::string>& words, const ChildOptions& options = {});

}  // namespace glint::apps
