#pragma once

#include <fftw3.h>

#include <memory>
#include <mutex>
#include <type_traits>

namespace glint::bake {

struct FftwFree {
  void operator()(void* memory) const { fftw_free(memory); }
};

/// Making and destroying plans, unlike executing them, is not thread-safe.
inline std::mutex& fftwPlannerMutex() {
  static std::mutex mutex;
  return mutex;
}

struct DestroyFftwPlan {
  void operator()(fftw_plan plan) const {
    const std::lock_guard lock(fftwPlannerMutex());
    fftw_destroy_plan(plan);
  }
};
using FftwPlan = std::unique_ptr<std::remove_pointer_t<fftw_plan>, DestroyFftwPlan>;

/// Makes a plan.
/// @param plan  plan(flags) -> fftw_plan. FFTW_ESTIMATE: measuring would choose algorithms, and so roundings, by the clock
template <class Plan>
FftwPlan makeFftwPlan(Plan&& plan) {
  const std::lock_guard lock(fftwPlannerMutex());
  return FftwPlan(plan(FFTW_ESTIMATE));
}

}  // namespace glint::bake
