#pragma once

// Stands in for CUDA's header when clang checks device_check.cu: what that program calls, declared only.

#include <cstddef>

enum cudaError_t { cudaSuccess };
enum cudaMemcpyKind { cudaMemcpyHostToDevice, cudaMemcpyDeviceToHost };
struct dim3 {
  unsigned x, y, z;
  dim3(unsigned count) : x(count), y(1), z(1) {}
};

cudaError_t cudaMalloc(void**, std::size_t);
cudaError_t cudaFree(void*);
cudaError_t cudaMemcpy(void*, const void*, std::size_t, cudaMemcpyKind);
cudaError_t cudaGetLastError();
cudaError_t cudaDeviceSynchronize();
cudaError_t cudaGetDeviceCount(int*);
const char* cudaGetErrorString(cudaError_t);

// What clang makes of a launch when it does not know the version of the toolkit.
extern "C" int cudaConfigureCall(dim3, dim3, std::size_t = 0, void* = nullptr);
