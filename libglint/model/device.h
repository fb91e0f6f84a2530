#pragma once

/// Marks a function that also compiles as CUDA device code.
/// Device code calls constexpr functions of the standard library: nvcc needs --expt-relaxed-constexpr; clang allows it by
/// itself.
#if defined(__CUDACC__) || defined(__CUDA__)
#define GLINT_HD __host__ __device__
#else
#define GLINT_HD
#endif

/// Inlines all that a function calls: left to itself, GCC does so in one program and not in the next. Not under sanitizers,
/// whose checks would make such a function take minutes to compile.
#if defined(__GNUC__) && !defined(__SANITIZE_ADDRESS__) && !defined(__SANITIZE_THREAD__)
#define GLINT_FLATTEN [[gnu::flatten]]
#else
#define GLINT_FLATTEN
#endif

namespace glint {

/// Asks for a cache line that will be read soon. Any address is fine.
inline GLINT_HD void prefetch([[maybe_unused]] const void* address) {
#if defined(__GNUC__) && !defined(__CUDA_ARCH__)
  __builtin_prefetch(address);
  // GCC takes a function that does nothing but this for one without effects, and leaves out calls of it.
  asm volatile("" : : "r"(address));
#endif
}

}  // namespace glint
