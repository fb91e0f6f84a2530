#pragma once

/// Compiles a function twice, for AVX2 with FMA and for the baseline; the loader chooses a version for the processor. For
/// kernels of plain loops, of which the compiler makes vectors. With sanitizers there is the baseline only, since the functions
/// that choose a version run before a sanitizer is ready.
#if defined(__x86_64__) && defined(__gnu_linux__) && !defined(__SANITIZE_ADDRESS__) && !defined(__SANITIZE_THREAD__)
#define GLINT_MULTIVERSION __attribute__((target_clones("arch=x86-64-v3", "default")))
#else
#define GLINT_MULTIVERSION
#endif
