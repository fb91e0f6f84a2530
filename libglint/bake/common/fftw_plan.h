#pragma once

#include <fftw3.h>

#include <memory>
#include <mutex>
#include <type_traits>

namespace glint::bake {

/// Frees memory of fftw_malloc.
struct FftwFree {
  void operator()(void* memory) const { fftw_free(memory); }
};

/// Guards making and destroying plans, which FFTW does not allow from several threads at once. Executing plans needs no guard.
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
/// @param plan  plan(flags) -> fftw_plan. The flags are FFTW_ESTIMATE: FFTW_MEASURE would choose algorithms, and so the
///              rounding of results, by the clock
template <class Plan>
FftwPlan makeFftwPlan(Plan&& plan) {
  const std::lock_guard lock(fftwPlannerMutex());
  return FftwPlan(plan(FFTW_ESTIMATE));
}

}  // namespace glint::bake
