#include "glint-bench/machine.h"

#include <sys/utsname.h>

#include <fstream>
#include <string>
#include <thread>

namespace glint::apps {
namespace {

std::string processorName() {
  std::ifstream info("/proc/cpuinfo");
  for (std::string line; std::getline(info, line);) {
    const std::size_t colon = line.find(": ");
    if (line.starts_with("model name") && colon != std::string::npos) return line.substr(colon + 2);
  }
  return "unknown";
}

}  // namespace

nlohmann::ordered_json machineJson() {
  utsname system{};
  ::uname(&system);
  return {{"processor", processorName()},
          {"cores", std::thread::hardware_concurrency()},
          {"system", std::string(system.sysname) + " " + system.release + " " + system.machine}};
}

}  // namespace glint::apps
