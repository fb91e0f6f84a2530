#pragma once

#include <fftw3.h>

#include <complex>
#include <memory>
#include <type_traits>

#include "glint/bake/common/fftw_plan.h"

namespace glint::bake {

struct DestroyFftwfPlan {
  void operator()(fftwf_plan plan) const {
    const std::lock_guard lock(fftwPlannerMutex());
    fftwf_destroy_plan(plan);
  }
};
/// A plan of single precision: coherent images are sums of squares of a few thousand numbers of size 1, and stored as halves.
using FftwfPlan = std::unique_ptr<std::remove_pointer_t<fftwf_plan>, DestroyFftwfPlan>;

struct FftwfFree {
  void operator()(std::complex<float>* memory) const { fftwf_free(memory); }
};
/// Memory that is aligned as plans expect it.
using FftwfBuffer = std::unique_ptr<std::complex<float>[], FftwfFree>;

inline FftwfBuffer makeFftwfBuffer(std::size_t count) {
  auto* memory = static_cast<std::complex<float>*>(fftwf_malloc(sizeof(std::complex<float>) * count));
  if (memory == nullptr) throw std::bad_alloc();
  return FftwfBuffer(memory);
}

/// Plan of a transform of [size][size] in place, forward. FFTW_ESTIMATE, so that results do not depend on the clock.
inline FftwfPlan makeSquarePlan(int size) {
  const FftwfBuffer buffer = makeFftwfBuffer(static_cast<std::size_t>(size) * size);
  auto* data = reinterpret_cast<fftwf_complex*>(buffer.get());
  const std::lock_guard lock(fftwPlannerMutex());
  return FftwfPlan(fftwf_plan_dft_2d(size, size, data, data, FFTW_FORWARD, FFTW_ESTIMATE));
}

/// Runs a plan on other memory of makeFftwfBuffer. Any number of threads may do so at once.
inline void runSquarePlan(const FftwfPlan& plan, std::complex<float>* data) {
  fftwf_execute_dft(plan.get(), reinterpret_cast<fftwf_complex*>(data), reinterpret_cast<fftwf_complex*>(data));
}

}  // namespace glint::bake
