#pragma once

/// Compiles a function twice, for AVX2 with FMA and for the baseline, and picks one at load time. For kernels whose plain loops
/// the compiler vectorises. Sanitizers cannot run in the resolvers, so they get the baseline.
#if defined(__x86_64__) && defined(__gnu_linux__) && !defined(__SANITIZE_ADDRESS__) && !defined(__SANITIZE_THREAD__)
#define GLINT_MULTIVERSION __attribute__((target_clones("arch=x86-64-v3", "default")))
#else
#define GLINT_MULTIVERSION
#endif
