#pragma once

// Every header of the library includes this one or is C++17: older compilers get one error that says what to do.
#if (defined(_MSVC_LANG) ? _MSVC_LANG : __cplusplus) < 202002L
#error "glint needs C++20: compile with -std=c++20 or /std:c++20, with CMake target_compile_features(app PRIVATE cxx_std_20)"
#endif

/// Marks a function that also compiles as CUDA device code.
///
/// Such functions call constexpr functions of the standard library: clang allows this, nvcc needs --expt-relaxed-constexpr.
/// Constants have no address in device code: functions that take a reference get a copy, as in `std::min(r, float{kRim})`.
#if defined(__CUDACC__) || defined(__CUDA__)
#define GLINT_HD __host__ __device__
#else
#define GLINT_HD
#endif

/// Marks a function that device code never inlines. Inlined everywhere, such functions would make kernels of a hundred thousand
/// instructions, which take nvcc minutes to compile.
#if defined(__CUDA_ARCH__)
#define GLINT_DEVICE_CALL [[gnu::noinline]]
#define GLINT_HOST_INLINE GLINT_DEVICE_CALL
#else
#define GLINT_DEVICE_CALL
/// Marks a function that device code never inlines and hosts always inline.
#define GLINT_HOST_INLINE [[gnu::always_inline]]
#endif

/// Inlines every call in a function. Without the attribute, GCC inlines in one program and not in another. Does nothing under
/// sanitizers: with their checks such a function takes minutes to compile.
#if defined(__GNUC__) && !defined(__SANITIZE_ADDRESS__) && !defined(__SANITIZE_THREAD__)
#define GLINT_FLATTEN [[gnu::flatten]]
#else
#define GLINT_FLATTEN
#endif

namespace glint {

/// Asks the memory for a cache line that will be read soon. Any address is allowed.
inline GLINT_HD void prefetch([[maybe_unused]] const void* address) {
#if defined(__GNUC__) && !defined(__CUDA_ARCH__)
  __builtin_prefetch(address);
  // Without this line, GCC takes a function that only prefetches for one without effects, and drops calls of it.
  asm volatile("" : : "r"(address));
#endif
}

}  // namespace glint
