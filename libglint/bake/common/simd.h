#pragma once

// Builders have SIMD of the best instruction set of the machine in two ways, with one exception.
//
// Highway is for kernels with explicit vectors: sums, conversions and shuffles, such as effective_kernels.cpp.
//
// GLINT_MULTIVERSION is for plain loops, of which the compiler makes vectors. Some of these loops call scalar functions of the
// query headers, which readers share: explicit vectors would need each formula a second time. It is also for the splat of
// flat_scatter.cpp, which builds a vector of four from four different scalars: with Highway these go through memory.
//
// One kernel has intrinsics: the conversion to halves of pyramid.cpp. On processors without an instruction for it, Highway 1.0
// truncates, and results would differ from the rounded halves of all other processors.

/// Compiles a function twice, for AVX2 with FMA and for the baseline; the loader chooses a version for the processor. With
/// sanitizers there is the baseline only, since the functions that choose a version run before a sanitizer is ready.
#if defined(__x86_64__) && defined(__gnu_linux__) && !defined(__SANITIZE_ADDRESS__) && !defined(__SANITIZE_THREAD__)
#define GLINT_MULTIVERSION __attribute__((target_clones("arch=x86-64-v3", "default")))
#else
#define GLINT_MULTIVERSION
#endif
