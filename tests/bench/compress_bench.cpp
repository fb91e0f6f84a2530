// Time of one angular block: a tensor of 16x16x64 of overlapping footprints on noise. Run with --benchmark_filter=NAME.

#include <benchmark/benchmark.h>

#include "glint/bake/compress.h"
#include "glint/bake/compress_cp.h"
#include "unit/compress_fixture.h"

namespace glint::bake {
namespace {

/// A map of 256^2 texels has 8x8 images at stride 32; the pyramid is cut to one block of directions.
const test::TestPyramid& oneBlock() {
  static const test::TestPyramid pyramid = [] {
    const PyramidShape shape = test::makeShape(256, 16, 32, 1);
    test::NormalField normals = test::isotropicNoise(256, 3.2f * 0.2f, 1);
    auto made = test::makePyramid(normals, [&] {
      PyramidShape wide = shape;
      wide.sigma_r = 0.08f;  // 0.64 pixel of 16, as 0.005 is of 256
      return wide;
    }());
    return made;
  }();
  return pyramid;
}

void cpTensor(benchmark::State& state) {
  const auto& pixels = oneBlock().pixels[0];
  const int count = static_cast<int>(pixels.size() / kBlockPixels);
  std::vector<float> slices(static_cast<std::size_t>(count) * kSliceStride, 0.0f);
  double energy = 0;
  for (int s = 0; s < count; ++s) {
    for (int p = 0; p < kBlockPixels; ++p) {
      slices[s * kSliceStride + p] = pixels[s * kBlockPixels + p];
      energy += static_cast<double>(slices[s * kSliceStride + p]) * slices[s * kSliceStride + p];
    }
  }
  CpFactors factors;
  for (auto _ : state) {
    TuckerAnalysis analysis;
    analysis.addMoments(slices.data(), count);
    analysis.solveAxes();
    analysis.addEnergies(slices.data(), count);
    factors =
        decomposeCp({slices.data(), count, nullptr, energy}, analysis.axes(), {static_cast<int>(state.range(0)), 1e-4, 500});
    benchmark::DoNotOptimize(factors);
  }
  state.counters["slices"] = count;
  state.counters["sweeps"] = factors.sweeps;
  state.counters["rel_l2"] = std::sqrt(factors.error / energy);
}
BENCHMARK(cpTensor)->Arg(8)->Arg(16)->Arg(32)->Arg(48)->Unit(benchmark::kMicrosecond);

/// Everything for one block: analysis, quantisation and measuring.
void compressBlock(benchmark::State& state, CompressionMethod method) {
  CompressionOptions options;
  options.method = method;
  options.rank = static_cast<int>(state.range(0));
  options.regions = 1;
  CompressionReport report;
  for (auto _ : state) benchmark::DoNotOptimize(compressPyramid(oneBlock().view(), options, &report));
  state.counters["slices"] = static_cast<double>(report.total.slices);
  state.counters["rel_l2"] = report.total.rel_l2;
  state.counters["bytes"] = static_cast<double>(report.total_bytes);
}
BENCHMARK_CAPTURE(compressBlock, cp, CompressionMethod::cp)->Arg(16)->Arg(32)->Unit(benchmark::kMicrosecond);
BENCHMARK_CAPTURE(compressBlock, tucker, CompressionMethod::tucker)->Arg(16)->Arg(25)->Unit(benchmark::kMicrosecond);
BENCHMARK_CAPTURE(compressBlock, pca, CompressionMethod::pca)->Arg(16)->Arg(32)->Unit(benchmark::kMicrosecond);

}  // namespace
}  // namespace glint::bake
