#pragma once

#include <fftw3.h>

#include <memory>
#include <mutex>
#include <type_traits>

namespace glint::bake {

struct FftwFree {
  void operator()(void* memory) const { fftw_free(memory); }
};
struct DestroyFftwPlan {
  void operator()(fftw_plan plan) const { fftw_destroy_plan(plan); }
};
using FftwPlan = std::unique_ptr<std::remove_pointer_t<fftw_plan>, DestroyFftwPlan>;

/// FFTW's planner, unlike its execution, is not thread-safe: hold this while planning.
inline std::mutex& fftwPlannerMutex() {
  static std::mutex mutex;
  return mutex;
}

}  // namespace glint::bake
