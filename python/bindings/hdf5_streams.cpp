// The archive of HDF5 is compiled for programs, not for shared libraries: it takes the addresses of stdout and stderr as if they were
// in the same file. The linker gives it these copies instead (--wrap), which hold the same streams.

#include <cstdio>

extern "C" {
extern std::FILE* __real_stdout;
extern std::FILE* __real_stderr;
std::FILE* __wrap_stdout = nullptr;
std::FILE* __wrap_stderr = nullptr;
}

namespace {
[[maybe_unused]] const bool set = [] {
  __wrap_stdout = __real_stdout;
  __wrap_stderr = __real_stderr;
  return true;
}();
}  // namespace
