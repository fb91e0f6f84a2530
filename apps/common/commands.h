#pragma once

#include <initializer_list>
#include <string_view>

namespace glint::apps {

/// Runs a command line. Returns the exit code.
using Run = int (*)(int argc, char** argv);

/// A command of a program: a word that stands first, and a command line of its own behind it.
struct Command {
  std::string_view word;
  Run run;
};

/// Runs the command whose word stands first, with the arguments behind the word; without such a word, runs `plain` with all. A
/// file that is named like a command is given as ./NAME.
int runCommand(int argc, char** argv, std::initializer_list<Command> commands, Run plain);

}  // namespace glint::apps
