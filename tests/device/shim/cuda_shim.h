#pragma once

// What CUDA's own headers give device code, as far as the query headers use it: enough for clang to compile device code where
// no CUDA toolkit is. Whatever is not here, and not constexpr, is a host function, and calling it is an error.

#define __host__ __attribute__((host))
#define __device__ __attribute__((device))
#define __global__ __attribute__((global))

extern "C" {
__device__ double sqrt(double);
__device__ double floor(double);
__device__ double ceil(double);
__device__ double fabs(double);
__device__ double sin(double);
__device__ double cos(double);
__device__ double atan2(double, double);
__device__ double hypot(double, double);
__device__ int abs(int);
__device__ void* memcpy(void*, const void*, __SIZE_TYPE__);
__device__ int __popcll(unsigned long long);
__device__ int __ffsll(long long);
}

struct ShimIndex {
  unsigned x, y, z;
};
extern const __device__ __attribute__((weak)) ShimIndex threadIdx, blockIdx, blockDim;

// Clang's own <new> for CUDA uses malloc and free without including them.
#include <cstdlib>
