#pragma once

/// Marks a function that also compiles as CUDA device code. The only macro of the public headers.
#if defined(__CUDACC__)
#define GLINT_HD __host__ __device__
#else
#define GLINT_HD
#endif
