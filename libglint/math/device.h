#pragma once

/// Marks a function that also compiles as CUDA device code.
/// Device code calls constexpr functions of the standard library: nvcc needs --expt-relaxed-constexpr; clang allows it by
/// itself. Constants are in no memory there: what takes a reference gets a copy, `std::min(r, float{kRim})`.
#if defined(__CUDACC__) || defined(__CUDA__)
#define GLINT_HD __host__ __device__
#else
#define GLINT_HD
#endif

/// Marks a function that device code calls, not inlines: copies of it wherever it is called would make kernels of a hundred
/// thousand instructions, which nvcc takes minutes to compile.
#if defined(__CUDA_ARCH__)
#define GLINT_DEVICE_CALL [[gnu::noinline]]
#define GLINT_HOST_INLINE GLINT_DEVICE_CALL
#else
#define GLINT_DEVICE_CALL
/// Marks such a function that the host always inlines.
#define GLINT_HOST_INLINE [[gnu::always_inline]]
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
