// Time and error of one angular block: a tensor of 16x16x64 of overlapping footprints on noise. Run with
// --benchmark_filter=NAME.

#include <benchmark/benchmark.h>

#include <algorithm>
#include <functional>
#include <numeric>

#include "glint/bake/compressed/compress.h"
#include "glint/bake/compressed/cp.h"
#include "glint/bake/pyramid/pyramid.h"
#include "glint/bake/synth/synth.h"
#include "support/test_maps.h"
#include "unit/compress_fixture.h"
#include "unit/compress_reference.h"

namespace glint::bake {
namespace {

/// The tensor of the design's table: the 8x8 finest images of a map of 256^2 texels of Gaussian noise, in the angular block
/// with the most energy. As a pyramid of images of that block alone.
const test::TestPyramid& oneBlock() {
  static const test::TestPyramid pyramid = [] {
    SynthOptions p = defaultSynthOptions(SynthKind::isotropic);
    p.width = p.height = 256;
    const test::OwnedMap map(256, 256, synthNormals(p));
    PyramidOptions o;
    o.levels = 1;
    o.precision = BlockPrecision::f32;
    const NdfPyramidData data = buildPyramid(map.map(), o);
    const NdfPyramid whole = data.view();
    const auto images = static_cast<int>(whole.shape.levels[0].imageCount());
    test::TestPyramid best;
    double most = 0;
    for (int block = 0; block < whole.shape.blocksPerImage(); ++block) {
      test::TestPyramid cut;
      cut.shape = test::makeShape(256, 16, 32, 1);
      cut.shape.sigma_r = whole.shape.sigma_r * static_cast<float>(whole.shape.resolution / kBlockSize);
      double energy = 0;
      for (int image = 0; image < images; ++image) {
        const std::vector<double> pixels = test::storedImage(whole, 0, static_cast<std::size_t>(image));
        std::vector<float> part;
        for (int q = 0; q < kBlockPixels; ++q) {
          const int blocks = whole.shape.blocksPerAxis();
          const int y = block / blocks * kBlockSize + q / kBlockSize, x = block % blocks * kBlockSize + q % kBlockSize;
          part.push_back(static_cast<float>(pixels[static_cast<std::size_t>(y * whole.shape.resolution + x)]));
          energy += static_cast<double>(part.back()) * part.back();
        }
        cut.addImage(0, part);
      }
      if (energy <= most) continue;
      most = energy;
      best = std::move(cut);
    }
    return best;
  }();
  return pyramid;
}

/// Its slices, as the decompositions take them.
struct Tensor {
  Tensor() {
    const auto& pixels = oneBlock().pixels[0];
    count = static_cast<int>(pixels.size() / kBlockPixels);
    slices.assign(static_cast<std::size_t>(count) * kSliceStride, 0.0f);
    for (int s = 0; s < count; ++s) {
      for (int p = 0; p < kBlockPixels; ++p) {
        slices[s * kSliceStride + p] = pixels[s * kBlockPixels + p];
        energy += static_cast<double>(slices[s * kSliceStride + p]) * slices[s * kSliceStride + p];
      }
    }
  }
  std::vector<float> slices;
  int count = 0;
  double energy = 0;
};

void cpTensor(benchmark::State& state) {
  const Tensor tensor;
  CpFactors factors;
  for (auto _ : state) {
    TuckerAnalysis analysis;
    analysis.addMoments(tensor.slices.data(), tensor.count);
    analysis.solveAxes();
    analysis.addEnergies(tensor.slices.data(), tensor.count);
    factors = decomposeCp({tensor.slices.data(), tensor.count, nullptr, tensor.energy}, analysis.axes(),
                          {static_cast<int>(state.range(0)), 1e-4, 500});
    benchmark::DoNotOptimize(factors);
  }
  state.counters["slices"] = tensor.count;
  state.counters["sweeps"] = factors.sweeps;
  state.counters["rel_l2"] = std::sqrt(factors.error / tensor.energy);
}

/// The core of Tucker-2 with its largest entries.
void tuckerTensor(benchmark::State& state) {
  const Tensor tensor;
  std::vector<double> entries;
  for (auto _ : state) {
    TuckerAnalysis analysis;
    analysis.addMoments(tensor.slices.data(), tensor.count);
    analysis.solveAxes();
    analysis.addEnergies(tensor.slices.data(), tensor.count);
    entries.assign(analysis.axes().energy[0], analysis.axes().energy[0] + kBlockPixels);
    std::sort(entries.begin(), entries.end(), std::greater<>());
    benchmark::DoNotOptimize(entries.data());
  }
  const double captured = std::accumulate(entries.begin(), entries.begin() + state.range(0), 0.0);
  state.counters["rel_l2"] = std::sqrt(std::max(0.0, tensor.energy - captured) / tensor.energy);
}
BENCHMARK(tuckerTensor)->Arg(16)->Arg(25)->Unit(benchmark::kMicrosecond);
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
  state.counters["bytes"] = static_cast<double>(report.total_bytes);
}
BENCHMARK_CAPTURE(compressBlock, cp, CompressionMethod::cp)->Arg(16)->Arg(32)->Unit(benchmark::kMicrosecond);
BENCHMARK_CAPTURE(compressBlock, tucker, CompressionMethod::tucker)->Arg(16)->Arg(25)->Unit(benchmark::kMicrosecond);
BENCHMARK_CAPTURE(compressBlock, pca, CompressionMethod::pca)->Arg(16)->Arg(32)->Unit(benchmark::kMicrosecond);

}  // namespace
}  // namespace glint::bake
