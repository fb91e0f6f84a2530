#pragma once

#include <CLI/CLI.hpp>
#include <cstdint>
#include <string>

namespace glint::apps {

/// Memory that this process may still take without hurting others, in bytes: the least of what the machine has available, what
/// the process's control groups leave, and what ulimit -v and ulimit -d leave, less a margin.
std::uint64_t availableMemory();

/// Makes availableMemory() return this. No limit of the system is set: libraries for images hang where they get no memory.
void limitMemory(std::uint64_t bytes);

/// "1.5 GB", "12 MB". Rounded up, so that the text as a value of --max-memory is no less than the number.
std::string memoryText(double bytes);

/// Reads sizes such as 500M, 8G or 1.5GiB, and hands them to CLI11 in bytes. A unit stands for powers of 1024.
CLI::Validator memorySize();

}  // namespace glint::apps
