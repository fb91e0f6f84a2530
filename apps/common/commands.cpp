#include "common/commands.h"

namespace glint::apps {

int runCommand(int argc, char** argv, std::initializer_list<Command> commands, Run plain) {
  for (const Command& command : commands)
    if (argc > 1 && argv[1] == command.word) return command.run(argc - 1, argv + 1);
  return plain(argc, argv);
}

}  // namespace glint::apps
