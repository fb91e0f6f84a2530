#include <tbb/parallel_for.h>

#include <cmath>
#include <memory>
#include <new>
#include <numbers>

#include "glint/bake/common/counter_random.h"
#include "glint/bake/common/fftw_plan.h"
#include "glint/bake/synth/kinds.h"

namespace glint::bake {
namespace {

constexpr std::uint64_t kNoiseStream = 1;

}  // namespace

std::vector<float> noiseHeights(const SynthOptions& p, float correlation_x, float correlation_y) {
  const int columns = p.width / 2 + 1;
  const std::size_t padded = 2 * static_cast<std::size_t>(columns);
  const std::unique_ptr<double, FftwFree> memory(
      static_cast<double*>(fftw_malloc(sizeof(double) * padded * static_cast<std::size_t>(p.height))));
  if (!memory) throw std::bad_alloc();
  auto* field = memory.get();
  auto* spectrum = reinterpret_cast<fftw_complex*>(field);
  const FftwPlan forward =
      makeFftwPlan([&](unsigned flags) { return fftw_plan_dft_r2c_2d(p.height, p.width, field, spectrum, flags); });
  const FftwPlan backward =
      makeFftwPlan([&](unsigned flags) { return fftw_plan_dft_c2r_2d(p.height, p.width, spectrum, field, flags); });

  // Draw white noise in space, not in frequency: its transform then has the symmetry of a real field for any size.
  tbb::parallel_for(0, p.height, [&](int j) {
    double* line = field + static_cast<std::size_t>(j) * padded;
    for (int i = 0; i < p.width; i += 2) {
      const auto index = static_cast<std::uint64_t>(j) * static_cast<std::uint64_t>(p.width) + static_cast<std::uint64_t>(i);
      const Vec2 g = randomGaussians(p.seed, kNoiseStream, index);
      line[i] = g.x;
      if (i + 1 < p.width) line[i + 1] = g.y;
    }
  });
  fftw_execute(forward.get());

  // Filter the noise. The square root of the power spectrum of the correlation exp(-r^2/t^2) is exp(-k^2 t^2 / 8).
  const auto amplitude = [](int index, int size, float correlation) {
    const int signed_index = index <= size / 2 ? index : index - size;
    const double k = 2 * std::numbers::pi * signed_index / size * correlation;
    return std::exp(-k * k / 8);
  };
  std::vector<double> amplitude_x(static_cast<std::size_t>(columns));
  for (int i = 0; i < columns; ++i) amplitude_x[static_cast<std::size_t>(i)] = amplitude(i, p.width, correlation_x);
  tbb::parallel_for(0, p.height, [&](int j) {
    const double amplitude_y = amplitude(j, p.height, correlation_y);
    fftw_complex* line = spectrum + static_cast<std::size_t>(j) * columns;
    for (int i = 0; i < columns; ++i) {
      const double factor = amplitude_x[static_cast<std::size_t>(i)] * amplitude_y;
      line[i][0] *= factor;
      line[i][1] *= factor;
    }
  });
  fftw_execute(backward.get());

  const double scale = 1 / (static_cast<double>(p.width) * p.height);
  std::vector<float> heights(static_cast<std::size_t>(p.width) * p.height);
  tbb::parallel_for(0, p.height, [&](int j) {
    const double* line = field + static_cast<std::size_t>(j) * padded;
    float* out = heights.data() + static_cast<std::size_t>(j) * p.width;
    for (int i = 0; i < p.width; ++i) out[i] = static_cast<float>(line[i] * scale);
  });
  return heights;
}

}  // namespace glint::bake
