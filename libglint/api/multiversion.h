#pragma once

// Private to libglint/api.

/// Compiles a function three times, for AVX-512, for AVX2 with FMA and for the baseline, and picks one at load time. Sanitizers
/// cannot run in the resolvers, so they get the baseline.
#if defined(__x86_64__) && defined(__gnu_linux__) && defined(__GNUC__) && !defined(__clang__) && \
    !defined(__SANITIZE_ADDRESS__) && !defined(__SANITIZE_THREAD__)
#define GLINT_API_MULTIVERSION __attribute__((flatten, target_clones("arch=x86-64-v4", "arch=x86-64-v3", "default")))
#else
#define GLINT_API_MULTIVERSION
#endif
